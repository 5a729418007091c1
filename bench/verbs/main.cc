// luxfield-bench: what `luxfield bench` is handed over to (cli/quick.h).
#include "luxfield/bench/verbs/verb_bench.h"
#include "luxfield/cli/run.h"

int main(int argc, char** argv) {
  return luxfield::cli::RunProgram(argc, argv, luxfield::bench::AddBench);
}

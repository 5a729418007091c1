#ifdef LUXFIELD_BENCH
#include "luxfield/bench/verbs/verb_bench.h"
#endif
#include "luxfield/cli/run.h"

int main(int argc, char** argv) {
#ifdef LUXFIELD_BENCH
  return luxfield::cli::Run(argc, argv, {luxfield::bench::AddBench});
#else
  return luxfield::cli::Run(argc, argv);
#endif
}

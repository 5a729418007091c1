#ifdef LUXFIELD_BENCH
#include "luxfield/bench/verbs/verb_bench.h"
#endif
#include "luxfield/cli/quick.h"

int main(int argc, char** argv) {
#ifdef LUXFIELD_BENCH
  return luxfield::cli::RunQuick(argc, argv, {{luxfield::bench::kBenchVerb, "luxfield-bench"}});
#else
  return luxfield::cli::RunQuick(argc, argv);
#endif
}

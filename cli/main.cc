#ifdef LUXFIELD_BENCH
#include "luxfield/bench/verbs/verb_bench.h"
#endif
#ifdef LUXFIELD_VIEW
#include "luxfield/view/verbs/verb_view.h"
#endif
#include "luxfield/cli/quick.h"

int main(int argc, char** argv) {
  const std::vector<luxfield::cli::VerbElsewhere> more = {
#ifdef LUXFIELD_VIEW
      {luxfield::view::kViewVerb, "luxfield-view"},
#endif
#ifdef LUXFIELD_BENCH
      {luxfield::bench::kBenchVerb, "luxfield-bench"},
#endif
  };
  return luxfield::cli::RunQuick(argc, argv, more);
}

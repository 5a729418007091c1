#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "luxfield/bench/all/work.h"
#include "luxfield/bench/bench_rays.h"
#include "luxfield/core/stopwatch.h"

namespace luxfield::bench {
namespace {

constexpr double kWithin = 1.2;  // of Embree's packets

std::vector<Figures> Measure(const AllOptions& options) {
  BenchRaysOptions how;
  how.runs = options.runs;
  how.device = options.device;
  how.threads = options.threads;
  std::vector<Figures> all;
  for (const RaySpeed& speed : BenchRays(how)) {
    Figures figures;
    figures.runs = speed.device;
    figures.peer = "Embree, packets of 16";
    figures.peer_value = core::Median(speed.embree_packets);
    figures.target = *figures.peer_value / kWithin;
    figures.limit =
        fmt::format("Embree, single rays {:.3g}; hits {:.4f}, Embree's {:.4f}",
                    core::Median(speed.embree_single), speed.device_hits, speed.embree_hits);
    all.push_back(figures);
  }
  return all;
}

}  // namespace

std::vector<WorkGroup> RayWorks() {
  const std::string unit = "Mrays/core-s";
  return {{{{"closest hit, 375k triangles", unit, 23, true},
            {"occlusion, incoherent (sky)", unit, 9.7, true},
            {"occlusion, coherent (area light)", unit, 21, true}},
           Measure}};
}

}  // namespace luxfield::bench

// A merge takes the same memory however long the session is. The program is a fresh process: what a
// test has allocated before is not in its peak.
#include <cstdio>
#include <cstdlib>
#include <string>

#include "tests/e2e/verb_test.h"

namespace luxfield::e2e {
namespace {

constexpr int kExposures = 3, kSensor = 768, kLattice = 300, kGridWidth = 2;

class MergeMemory : public VerbTest {
 protected:
  void SetUp() override {
    VerbTest::SetUp();
    // The address sanitizer keeps 256 MiB of freed memory unless it is told not to.
    const char* options = std::getenv("ASAN_OPTIONS");
    setenv("ASAN_OPTIONS",
           ((options ? std::string(options) + ":" : "") + "quarantine_size_mb=0").c_str(), 1);
  }

  // Largest resident set of a process that merges a session of 2 x `grid_height` positions, MiB.
  double PeakMib(int grid_height) {
    std::vector<std::string> merge = {
        "bench",  "merge",          "--keep",
        "--case", "cached, hashes", "--threads",
        "2",      "--folder",       "bench" + std::to_string(grid_height)};
    for (const auto& [option, value] : {std::pair{"--grid-width", kGridWidth},
                                        {"--grid-height", grid_height},
                                        {"--exposures", kExposures},
                                        {"--sensor", kSensor},
                                        {"--lattice", kLattice}}) {
      merge.emplace_back(option);
      merge.push_back(std::to_string(value));
    }
    Run(merge);  // writes the session
    const nlohmann::json row = Run(merge).at("rows").at(0);
    EXPECT_EQ(row.at("positions"), kGridWidth * grid_height);
    return row.at("peak_mib");
  }
};

TEST_F(MergeMemory, DoesNotGrowWithTheNumberOfPositions) {
  const double few = PeakMib(4), many = PeakMib(12);
  // Of a position: its frames of 16 bit, and per texel two floats, a count and a mask. 16 more
  // positions of them are 76 MiB, of the texels alone 22 MiB; heaps differ by 4 MiB from run to
  // run.
  constexpr double kMib = 1 << 20, kFrames = 2.0 * kExposures * kSensor * kSensor / kMib,
                   kTexels = 16.0 * kLattice * kLattice / kMib;
  std::printf("peak %.1f MiB with 8 positions, %.1f MiB with 24; a position has %.1f + %.1f MiB\n",
              few, many, kFrames, kTexels);
  EXPECT_GT(few, kFrames);
  EXPECT_LT(many, few + 2 * (kFrames + kTexels));
}

}  // namespace
}  // namespace luxfield::e2e

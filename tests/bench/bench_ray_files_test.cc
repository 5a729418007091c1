#include "luxfield/bench/all/bench_ray_files.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <set>

#include "luxfield/lightfield/posed_light_field.h"
#include "tests/formats/light_field_lamps.h"

namespace luxfield::bench {
namespace {

// Every work of every format once, on a lamp of a few rays, and nothing of it left.
TEST(BenchRayFiles, MeasuresEveryWorkOfEveryFormat) {
  BenchRayFilesOptions options;
  options.folder =
      std::filesystem::path(testing::TempDir()) / ("bench_ray_files_" + std::to_string(::getpid()));
  std::filesystem::create_directories(options.folder);
  options.light_field = options.folder / "lamp.lf.exr";
  lightfield::WriteLightFields(options.light_field, formats::AsymmetricLamp());
  options.rays = 2000;
  options.runs = 1;
  options.formats = {"dat", "speos.ray"};
  std::set<std::string> works;
  for (const auto& row : BenchRayFiles(options)) {
    works.insert(row.at("format").get<std::string>() + " " + row.at("work").get<std::string>());
    EXPECT_EQ(row.at("rays"), 2000);
    // 28 bytes a ray and 208 of the header, 32 and 28.
    EXPECT_NEAR(row.at("mib").get<double>() * 0x1p20,
                row.at("format") == "dat" ? 2000 * 28 + 208 : 2000 * 32 + 28, 1e-6);
    EXPECT_GT(row.at("wall_s"), 0);
    EXPECT_GT(row.at("mib_per_s"), 0);
    EXPECT_GT(row.at("peak_mib"), 1);
  }
  EXPECT_EQ(works.size(), 10u);
  EXPECT_FALSE(std::filesystem::exists(options.folder / "rays.dat"));
  EXPECT_FALSE(std::filesystem::exists(options.folder / "plain.bin"));
  std::filesystem::remove_all(options.folder);
}

}  // namespace
}  // namespace luxfield::bench

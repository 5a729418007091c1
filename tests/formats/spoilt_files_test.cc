// A sample of what `./run fuzz` gives the parsers of other people's files: the seeds that are
// committed for it, damaged at random.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "luxfield/core/file.h"
#include "tests/fuzz/photometric_files.h"
#include "tests/fuzz/ray_files.h"
#include "tests/fuzz/seeded.h"

namespace luxfield::fuzz {
namespace {

struct Parser {
  const char* name;
  void (*target)(std::string_view input);
};

class SpoiltFiles : public testing::TestWithParam<Parser> {};

TEST_P(SpoiltFiles, AreReadOrRefused) {
  const auto folder =
      std::filesystem::path(LUXFIELD_SOURCE_DIR) / "tests/fuzz/seeds" / GetParam().name;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry);
  std::sort(files.begin(), files.end());
  std::vector<std::string> seeds;
  for (const auto& file : files) seeds.push_back(core::ReadFile(file));
  Seeded(GetParam().target, seeds, 1000);
}

INSTANTIATE_TEST_SUITE_P(
    OfFormats, SpoiltFiles,
    testing::Values(Parser{"Lm63File", Lm63File}, Parser{"EulumdatFile", EulumdatFile},
                    Parser{"Tm33File", Tm33File}, Parser{"GldfFile", GldfFile},
                    Parser{"GldfProduct", GldfProduct}, Parser{"L3dStructure", L3dStructure},
                    Parser{"ObjMesh", ObjMesh}, Parser{"XmlDocument", XmlDocument},
                    Parser{"ZipArchive", ZipArchive}, Parser{"Tm25File", Tm25File},
                    Parser{"ZemaxFile", ZemaxFile}, Parser{"LightToolsFile", LightToolsFile},
                    Parser{"LightToolsTextFile", LightToolsTextFile},
                    Parser{"SpeosFile", SpeosFile}),
    [](const auto& parser) { return std::string(parser.param.name); });

}  // namespace
}  // namespace luxfield::fuzz

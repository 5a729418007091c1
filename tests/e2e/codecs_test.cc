// What decodes pictures is loaded when one comes, and a machine without it is told what it lacks.
#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "tests/e2e/verb_test.h"

namespace luxfield::e2e {
namespace {

class Codecs : public VerbTest {
 protected:
  Outcome WithoutCodecs(std::vector<std::string> arguments) {
    std::vector<std::string> words{
        "env", fmt::format("LD_PRELOAD={}", BuiltProgram("no_codecs.so").string()),
        BuiltProgram("luxfield").string()};
    words.insert(words.end(), arguments.begin(), arguments.end());
    return RunProgram(words, folder_);
  }
};

TEST_F(Codecs, AreNamedWhereTheyAreMissing) {
  for (const char* name : {"a.png", "b.png"})
    cv::imwrite((folder_ / name).string(), cv::Mat(8, 8, CV_8UC1, cv::Scalar(7)));
  const Outcome outcome = WithoutCodecs(
      {"calibrate", "response", "a.png", "b.png", "--exposure", "1,2", "-o", "x.cal.json"});
  EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
  EXPECT_NE(outcome.err.find("libopencv_imgcodecs"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("install OpenCV's codecs"), std::string::npos) << outcome.err;
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "x.cal.json"));
}

// They take four times as long to load as the rest of the program.
TEST_F(Codecs, AreNotLoadedAtTheStart) {
  EXPECT_EQ(WithoutCodecs({"devices", "--help"}).exit_code, 0);
  const Outcome libraries = RunProgram({"ldd", BuiltProgram("luxfield-verbs").string()}, folder_);
  ASSERT_EQ(libraries.exit_code, 0) << libraries.err;
  EXPECT_NE(libraries.out.find("libc.so"), std::string::npos) << libraries.out;
  for (const char* library : {"opencv_imgcodecs", "gdal"})
    EXPECT_EQ(libraries.out.find(library), std::string::npos) << libraries.out;
}

}  // namespace
}  // namespace luxfield::e2e

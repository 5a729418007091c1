// main() of every test program. Programs run side by side, each in a temporary folder of its own; one
// that never ends is stopped by the processor time that it takes, which a busy machine does not raise.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr rlim_t kProcessorSeconds = 20'000;
#else
constexpr rlim_t kProcessorSeconds = 2'000;
#endif

// What std::filesystem, GoogleTest and programs that are started take for the temporary folder.
class OwnTemporaryFolder {
 public:
  OwnTemporaryFolder()
      : path_((std::filesystem::temp_directory_path() / "luxfield_test_XXXXXX").string()) {
    if (::mkdtemp(path_.data()) == nullptr) {
      std::perror(path_.c_str());
      std::exit(1);
    }
    ::setenv("TMPDIR", path_.c_str(), 1);
    ::setenv("TEST_TMPDIR", path_.c_str(), 1);
  }
  ~OwnTemporaryFolder() {
    std::error_code error;  // what a test made unreadable stays
    std::filesystem::remove_all(path_, error);
  }
  OwnTemporaryFolder(const OwnTemporaryFolder&) = delete;
  OwnTemporaryFolder& operator=(const OwnTemporaryFolder&) = delete;

 private:
  std::string path_;
};

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleMock(&argc, argv);
  if (GTEST_FLAG_GET(list_tests)) return RUN_ALL_TESTS();
  const rlimit limit{kProcessorSeconds, kProcessorSeconds + 5};
  ::setrlimit(RLIMIT_CPU, &limit);
  if (std::getenv("TEST_TMPDIR"))
    return RUN_ALL_TESTS();  // started by a test, in that one's folder
  const OwnTemporaryFolder folder;
  return RUN_ALL_TESTS();
}

#include "luxfield/core/input_file.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <thread>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/file.h"

namespace luxfield::core {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

class InputFile : public testing::Test {
 protected:
  void SetUp() override {
    std::string name =
        (std::filesystem::path(testing::TempDir()) / "luxfield_input_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_;
};

TEST_F(InputFile, IsNoFolderDeviceOrSocket) {
  for (const char* device : {"/dev/zero", "/dev/null", "/dev/full"}) {
    EXPECT_THAT([&] { ReadFile(device); },
                ThrowsMessage<InputError>(HasSubstr("is a device, not a file")));
    EXPECT_THAT([&] { ReadStart(device, 4); },
                ThrowsMessage<InputError>(HasSubstr("is a device, not a file")));
    EXPECT_THAT([&] { ExrReader reader(device); },
                ThrowsMessage<InputError>(HasSubstr("is a device, not a file")));
  }
  EXPECT_THAT([&] { ReadFile(folder_); }, ThrowsMessage<InputError>(HasSubstr("is a folder")));

  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string socket = (folder_ / "s").string();
  ASSERT_LT(socket.size(), sizeof address.sun_path);
  std::strcpy(address.sun_path, socket.c_str());
  const int listening = ::socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(::bind(listening, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  EXPECT_THAT([&] { ReadFile(socket); }, ThrowsMessage<InputError>(HasSubstr("is a socket")));
  ::close(listening);
}

// As `<(command)` in a shell; what is read here and there would be lost.
TEST_F(InputFile, APipeIsReadToItsEndWhereTheWholeIsRead) {
  const auto pipe = folder_ / "p";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THAT([&] { ReadStart(pipe, 4); }, ThrowsMessage<InputError>(HasSubstr("is a pipe")));
  EXPECT_THAT([&] { ExrReader reader(pipe); }, ThrowsMessage<InputError>(HasSubstr("is a pipe")));
  const std::string text(200000, 'x');
  std::thread writer([&] { std::ofstream(pipe) << text; });
  EXPECT_EQ(ReadFile(pipe), text);
  writer.join();
}

TEST_F(InputFile, IsNoLongerThanAskedFor) {
  const auto file = folder_ / "f";
  std::ofstream(file) << "12345";
  EXPECT_EQ(ReadAtMost(file, 5), "12345");
  EXPECT_THAT([&] { ReadAtMost(file, 4); },
              ThrowsMessage<InputError>(HasSubstr("is longer than the 4 bytes")));
  EXPECT_EQ(ReadStart(file, 4), "1234");
  EXPECT_EQ(ReadStart(file, 9), "12345");
}

}  // namespace
}  // namespace luxfield::core

// Hashes against published vectors; files that exist whole or not at all.
#include "luxfield/core/file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <barrier>
#include <fstream>
#include <functional>
#include <thread>
#include <vector>

#include "luxfield/core/error.h"

namespace luxfield::core {
namespace {

// An empty folder of its own for each test.
class FileTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(testing::TempDir()) /
              (std::string("core_file_") + std::to_string(::getpid()) + info->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  int Entries() const {
    int count = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder_)) ++count;
    return count;
  }

  std::filesystem::path folder_;
};

using Sha256Test = FileTest;

// FIPS 180-2, appendix B.
TEST_F(Sha256Test, KnownVectors) {
  EXPECT_EQ(Sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(Sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(Sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
}

TEST_F(Sha256Test, OfAFileLongerThanOnePiece) {
  const auto path = folder_ / "million";
  std::ofstream(path) << std::string(1000000, 'a') << std::string(1000000, 'a');
  EXPECT_EQ(Sha256OfFile(path), Sha256(std::string(2000000, 'a')));
  std::ofstream(path) << std::string(1000000, 'a');
  EXPECT_EQ(Sha256OfFile(path), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
  EXPECT_THROW(Sha256OfFile(folder_ / "absent"), InputError);
}

// RFC 3720 B.4.
TEST(Crc32c, KnownVectors) {
  EXPECT_EQ(Crc32c(""), 0u);
  EXPECT_EQ(Crc32c("123456789"), 0xE3069283u);
  EXPECT_EQ(Crc32c(std::string(32, '\0')), 0x8A9136AAu);
  EXPECT_EQ(Crc32c(std::string(32, '\xff')), 0x62A8AB43u);
  std::string ascending;
  for (char c = 0; c < 32; ++c) ascending += c;
  EXPECT_EQ(Crc32c(ascending), 0x46DD794Eu);
  EXPECT_EQ(Crc32c(std::string(ascending.rbegin(), ascending.rend())), 0x113FDB5Cu);
}

using AtomicFile = FileTest;

TEST_F(AtomicFile, WritesAndReplacesWhole) {
  const auto path = folder_ / "a.bin";
  std::string bytes(300000, 'x');
  bytes[5] = '\0';
  WriteFileAtomically(path, bytes);
  EXPECT_EQ(ReadFile(path), bytes);
  WriteFileAtomically(path, "short");
  EXPECT_EQ(ReadFile(path), "short");
  EXPECT_EQ(Entries(), 1);
}

TEST_F(AtomicFile, AFailingWriterLeavesTheOldFileAndNothingElse) {
  const auto path = folder_ / "a.exr";
  WriteFileAtomically(path, "old");
  EXPECT_THROW(WriteAtomically(path,
                               [&](const std::filesystem::path& temporary) {
                                 EXPECT_EQ(temporary.extension(), ".exr");
                                 EXPECT_EQ(temporary.parent_path(), folder_);
                                 std::ofstream(temporary) << "half";
                                 throw DeviceError("disk full");
                               }),
               DeviceError);
  EXPECT_EQ(ReadFile(path), "old");
  EXPECT_EQ(Entries(), 1);
}

// As a process of another container may hold names of this one's number.
TEST_F(AtomicFile, NamesThatOthersHoldArePassedOver) {
  const auto path = folder_ / "a.txt";
  std::string name;
  WriteAtomically(path, [&](const std::filesystem::path& temporary) {
    name = temporary.filename().string();
    std::ofstream(temporary) << "first";
  });
  const std::size_t dash = name.rfind('-'), end = name.find(".tmp", dash);
  const int number = std::stoi(name.substr(dash + 1, end - dash - 1));
  for (int k = 1; k <= 3; ++k)
    std::ofstream(folder_ /
                  (name.substr(0, dash + 1) + std::to_string(number + k) + name.substr(end)))
        << "other";
  WriteFileAtomically(path, "second");
  EXPECT_EQ(ReadFile(path), "second");
  EXPECT_EQ(Entries(), 4);
}

TEST_F(AtomicFile, AWriterThatWritesNothingIsAnError) {
  EXPECT_THROW(WriteAtomically(folder_ / "a", [](const std::filesystem::path&) {}), DeviceError);
  EXPECT_EQ(Entries(), 0);
}

TEST_F(AtomicFile, FoldersThatDoNotExistAndNamesThatAreFolders) {
  try {
    WriteFileAtomically(folder_ / "absent" / "a", "x");
    ADD_FAILURE();
  } catch (const DeviceError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr((folder_ / "absent" / "a").string()));
    EXPECT_EQ(error.exit_code(), 3);
  }
  std::filesystem::create_directory(folder_ / "taken");
  EXPECT_THROW(WriteFileAtomically(folder_ / "taken", "x"), InputError);
  EXPECT_EQ(Entries(), 1);
}

// Whether `write` says that a file does not take the place of what is there, and nothing is left.
void ExpectRefused(const std::function<void()>& write) {
  try {
    write();
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("is no file that can be replaced"));
  }
}

// Links to them too; a link to a file, and one to nothing, are replaced.
TEST_F(AtomicFile, PipesAndDevicesAreNotReplaced) {
  namespace fs = std::filesystem;
  const auto fifo = folder_ / "fifo", link = folder_ / "link";
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  for (const fs::path& leads_to : {fifo, fs::path("/dev/full")}) {
    fs::create_symlink(leads_to, link);
    ExpectRefused([&] { WriteFileAtomically(link, "x"); });
    EXPECT_TRUE(fs::is_symlink(link));
    fs::remove(link);
  }
  ExpectRefused([&] { WriteFileAtomically(fifo, "x"); });
  ExpectRefused(
      [&] { WriteAtomically(fifo, [](const fs::path&) { ADD_FAILURE() << "work for nothing"; }); });
  EXPECT_TRUE(fs::is_fifo(fifo));
  EXPECT_EQ(Entries(), 1);
  for (const char* leads_to : {"absent", "file"}) {
    WriteFileAtomically(folder_ / "file", "old");
    fs::create_symlink(leads_to, link);
    WriteFileAtomically(link, "new");
    EXPECT_FALSE(fs::is_symlink(link));
    EXPECT_EQ(ReadFile(link) + ReadFile(folder_ / "file"), "newold");
    fs::remove(link);
  }
}

// It comes into being while the file is written.
TEST_F(AtomicFile, APipeThatComesMeanwhileIsNotReplaced) {
  const auto fifo = folder_ / "fifo";
  ExpectRefused([&] {
    WriteAtomically(fifo, [&](const std::filesystem::path& temporary) {
      std::ofstream(temporary) << "x";
      ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
    });
  });
  EXPECT_TRUE(std::filesystem::is_fifo(fifo));
  EXPECT_EQ(Entries(), 1);
}

// Each of several makes it, or finds that another has.
TEST_F(AtomicFile, AFolderIsMadeBySeveralAtOnce) {
  for (int round = 0; round < 200; ++round) {
    const auto made = folder_ / std::to_string(round) / "a";
    std::barrier begin(3);
    std::vector<std::jthread> makers;
    makers.reserve(3);
    for (int k = 0; k < 3; ++k)
      makers.emplace_back([&] {
        begin.arrive_and_wait();
        EXPECT_NO_THROW(MakeFolder(made));
        EXPECT_TRUE(std::filesystem::is_directory(made));
      });
  }
}

TEST_F(AtomicFile, ReadingWhatIsNoFile) {
  for (const auto& path : {folder_ / "absent", folder_}) {
    try {
      ReadFile(path);
      ADD_FAILURE() << path;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(path.string()));
      EXPECT_EQ(error.exit_code(), 2);
    }
  }
}

}  // namespace
}  // namespace luxfield::core

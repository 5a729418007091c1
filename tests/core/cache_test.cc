// What is kept between runs: whole or not at all, of one user, bounded, the longest unused first to
// go.
#include "luxfield/core/cache.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>

#include "luxfield/core/build_id.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/random.h"
#include "tests/cache_folder.h"

namespace luxfield::core {
namespace {

namespace fs = std::filesystem;

class CacheTest : public testing::Test {
 protected:
  fs::path Store() const { return cache_.store(); }
  std::vector<fs::path> Files() const { return cache_.Files(); }

  const CacheFolder cache_{"core"};
  const fs::path home_ = cache_.home();
};

// Without text like a header's, and with all bytes.
std::string Value(std::size_t bytes) {
  std::string value;
  for (std::size_t k = 0; k < bytes; ++k) value += static_cast<char>(k * k + k / 251);
  return value;
}

TEST_F(CacheTest, GivesBackWhatWasPutUnderTheKeyAlone) {
  const CacheKey key{"table", "lamp\n7"};
  EXPECT_EQ(FindInCache(key), std::nullopt);
  const std::string value = Value(70000);
  ASSERT_TRUE(PutIntoCache(key, value));
  EXPECT_EQ(FindInCache(key), value);
  EXPECT_EQ(FindInCache({"table", "lamp\n8"}), std::nullopt);
  EXPECT_EQ(FindInCache({"volume", "lamp\n7"}), std::nullopt);
  ASSERT_TRUE(PutIntoCache(key, ""));
  EXPECT_EQ(FindInCache(key), "");
  ASSERT_TRUE(PutIntoCache({"kernel", "k"}, Value(1000)));
  const CacheUse use = CacheInUse();
  EXPECT_EQ(use.unused, "");
  EXPECT_EQ(use.folder, Store());
  ASSERT_EQ(use.kinds.size(), 2u);
  EXPECT_EQ(use.kinds.at("kernel").entries, 1u);
  EXPECT_GT(use.kinds.at("kernel").bytes, 1000u);
  EXPECT_EQ(use.bytes, use.kinds.at("kernel").bytes + use.kinds.at("table").bytes);
  EXPECT_EQ(use.limit_bytes, std::uint64_t{1} << 30);
}

TEST_F(CacheTest, ADamagedEntryIsAbsentAndGoes) {
  const CacheKey key{"table", "a key of some length"};
  const std::string value = Value(300);
  ASSERT_TRUE(PutIntoCache(key, value));
  const fs::path file = Files().at(0);
  const std::string whole = ReadFile(file);
  const auto spoil = [&](const std::string& content) {
    std::ofstream(file, std::ios::binary) << content;
    EXPECT_EQ(FindInCache(key), std::nullopt);
    EXPECT_FALSE(fs::exists(file));
  };
  for (std::size_t at = 0; at < whole.size(); ++at) {  // of line, key and value
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 4);
    spoil(damaged);
  }
  for (const std::size_t length : {std::size_t{0}, std::size_t{10}, whole.size() - 1})
    spoil(whole.substr(0, length));
  spoil(whole + "more");
  // Another key's entry under this one's name.
  ASSERT_TRUE(PutIntoCache({"table", "another key of length"}, value));
  fs::rename(Files().at(0), file);
  EXPECT_EQ(FindInCache(key), std::nullopt);
  ASSERT_TRUE(PutIntoCache(key, value));
  EXPECT_EQ(FindInCache(key), value);
}

TEST_F(CacheTest, WhatWasNotUsedForLongestGoes) {
  const auto key = [](int k) { return CacheKey{"table", std::to_string(k)}; };
  LimitCache(100000);
  EXPECT_EQ(CacheInUse().limit_bytes, 100000u);
  EXPECT_FALSE(PutIntoCache(key(99), Value(25001)));  // more than a quarter
  const auto name = [&](int k) {
    ASSERT_TRUE(PutIntoCache(key(k), Value(20000)));
    for (const fs::path& file : Files()) {
      if (file.extension() != ".table") continue;
      // As if an hour lay between them.
      fs::last_write_time(file, fs::last_write_time(file) - std::chrono::hours(1));
    }
  };
  for (int k = 0; k < 4; ++k) name(k);
  EXPECT_TRUE(FindInCache(key(0)));  // used again, so that 1 is the oldest
  for (int k = 4; k < 6; ++k) ASSERT_TRUE(PutIntoCache(key(k), Value(20000)));
  EXPECT_LE(CacheInUse().bytes, 100000u);
  EXPECT_FALSE(FindInCache(key(1)));
  for (const int k : {0, 4, 5}) EXPECT_TRUE(FindInCache(key(k))) << k;
  LimitCache(50000);
  EXPECT_LE(CacheInUse().bytes, 50000u);
  EXPECT_GT(CacheInUse().bytes, 0u);
  EXPECT_GT(ClearCache(), 20000u);
  EXPECT_EQ(CacheInUse().bytes, 0u);
  EXPECT_EQ(CacheInUse().limit_bytes, 50000u);
}

TEST_F(CacheTest, IsNotUsedWhereItIsOff) {
  const CacheKey key{"table", "k"};
  ASSERT_TRUE(PutIntoCache(key, "value"));
  ::setenv("LUXFIELD_CACHE", "off", 1);
  EXPECT_FALSE(FindInCache(key));
  EXPECT_FALSE(PutIntoCache(key, "value"));
  EXPECT_NE(CacheInUse().unused, "");
  EXPECT_THROW(ClearCache(), DeviceError);
  ::unsetenv("LUXFIELD_CACHE");
  EXPECT_TRUE(FindInCache(key));
}

TEST_F(CacheTest, AFolderOthersMayWriteToIsNotUsed) {
  const CacheKey key{"kernel", "k"};
  ASSERT_TRUE(PutIntoCache(key, "value"));
  struct stat status {};
  ASSERT_EQ(::stat(Store().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0700u);
  fs::permissions(Store(), fs::perms::group_write, fs::perm_options::add);
  EXPECT_FALSE(FindInCache(key));
  EXPECT_FALSE(PutIntoCache(key, "value"));
  EXPECT_NE(CacheInUse().unused, "");
  EXPECT_THROW(LimitCache(1000), DeviceError);
  fs::permissions(Store(), fs::perms::owner_all);
  EXPECT_TRUE(FindInCache(key));

  // A link, an entry that others may write to, and a folder.
  const fs::path entry = Files().at(0);
  fs::permissions(entry, fs::perms::others_write, fs::perm_options::add);
  EXPECT_FALSE(FindInCache(key));
  fs::permissions(entry, fs::perms::owner_read | fs::perms::owner_write);
  fs::rename(entry, home_ / "elsewhere");
  fs::create_symlink(home_ / "elsewhere", entry);
  EXPECT_FALSE(FindInCache(key));
  fs::remove(entry);
  fs::create_directory(entry);
  EXPECT_FALSE(FindInCache(key));
  EXPECT_FALSE(PutIntoCache(key, "value"));
  fs::remove_all(Store());
  fs::create_symlink(home_ / "elsewhere", Store());
  EXPECT_FALSE(PutIntoCache(key, "value"));
  if (::geteuid() != 0) return;  // only root gives files away
  fs::remove(Store());
  ASSERT_TRUE(PutIntoCache(key, "value"));
  ASSERT_EQ(::chown(Files().at(0).c_str(), 1, 1), 0);
  EXPECT_FALSE(FindInCache(key));
  ASSERT_EQ(::chown(Files().at(0).c_str(), 0, 0), 0);
  EXPECT_TRUE(FindInCache(key));
  ASSERT_EQ(::chown(Store().c_str(), 1, 1), 0);
  EXPECT_FALSE(FindInCache(key));
}

// Eight processes put, find and evict at once: what they find is what belongs under the key.
TEST_F(CacheTest, ManyProcessesUseItAtOnce) {
  LimitCache(60000);
  const auto value = [](std::uint64_t k) { return Value(3000 + 100 * k) + std::to_string(k); };
  std::vector<pid_t> children;
  for (std::uint64_t number = 0; number < 8; ++number) {
    const pid_t child = ::fork();
    if (child == 0) {
      Random random(9, number);
      int wrong = 0;
      for (int round = 0; round < 100; ++round) {
        const auto k = static_cast<std::uint64_t>(30 * random.Uniform());
        const CacheKey key{"table", std::to_string(k)};
        if (const auto found = FindInCache(key))
          wrong += *found != value(k);
        else
          wrong += !PutIntoCache(key, value(k));
      }
      ::_exit(wrong > 0);
    }
    children.push_back(child);
  }
  for (const pid_t child : children) {
    int status = -1;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_EQ(status, 0);
  }
  EXPECT_LE(CacheInUse().bytes, 60000u);
  EXPECT_GT(CacheInUse().bytes, 20000u);
}

TEST_F(CacheTest, KeysOfComputedValuesNameTheBuild) {
  ASSERT_FALSE(BuildId().empty());
  EXPECT_EQ(BuildId().find_first_not_of("0123456789abcdef "), std::string::npos);
  EXPECT_EQ(BuildId(), BuildId());
  const auto key = KeyOfThisBuild("table", "k");
  ASSERT_TRUE(key);
  EXPECT_EQ(key->kind, "table");
  EXPECT_EQ(key->text, BuildId() + "\nk");
}

}  // namespace
}  // namespace luxfield::core

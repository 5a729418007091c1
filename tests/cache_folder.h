// A cache (core/cache.h) of a test's own: empty, and gone with the object.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace luxfield {

class CacheFolder {
 public:
  explicit CacheFolder(const std::string& name)
      : home_(std::filesystem::path(testing::TempDir()) / ("luxfield_cache_" + name)) {
    std::filesystem::remove_all(home_);
    if (const char* old = std::getenv("XDG_CACHE_HOME")) old_ = old;
    ::setenv("XDG_CACHE_HOME", home_.c_str(), 1);
    ::unsetenv("LUXFIELD_CACHE");
  }
  ~CacheFolder() {
    ::unsetenv("LUXFIELD_CACHE");
    if (old_.empty())
      ::unsetenv("XDG_CACHE_HOME");
    else
      ::setenv("XDG_CACHE_HOME", old_.c_str(), 1);
    std::filesystem::remove_all(home_);
  }
  CacheFolder(const CacheFolder&) = delete;
  CacheFolder& operator=(const CacheFolder&) = delete;

  const std::filesystem::path& home() const { return home_; }
  std::filesystem::path store() const { return home_ / "luxfield/store"; }
  std::vector<std::filesystem::path> Files() const {
    std::vector<std::filesystem::path> files;
    std::error_code none;
    for (const auto& entry : std::filesystem::directory_iterator(store(), none))
      files.push_back(entry.path());
    return files;
  }
  // Two bytes of the value of every entry are others.
  void Damage() const {
    for (const auto& path : Files()) {
      std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
      file.seekg(-100, std::ios::end);
      const int first = file.get(), second = file.get();
      file.seekp(-100, std::ios::end);
      file.put(static_cast<char>(first ^ 0x11));
      file.put(static_cast<char>(second ^ 0x22));
    }
  }

 private:
  std::filesystem::path home_;
  std::string old_;
};

// What `make` gives with a cold cache, in which it leaves one entry, with a warm one, a damaged one
// and none: judged by same(cold, other).
template <typename Make, typename Same>
void ExpectSameWithAnyCache(const CacheFolder& cache, const Make& make, const Same& same) {
  const auto built = make();
  ASSERT_EQ(cache.Files().size(), 1u);
  same(built, make());
  cache.Damage();
  same(built, make());
  EXPECT_EQ(cache.Files().size(), 1u);
  ::setenv("LUXFIELD_CACHE", "off", 1);
  same(built, make());
  ::unsetenv("LUXFIELD_CACHE");
}

}  // namespace luxfield

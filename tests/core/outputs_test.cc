// A verb's files come into being together or not at all, and what killed verbs left is swept.
#include "luxfield/core/outputs.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <optional>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"

namespace luxfield::core {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

class OutputsTest : public testing::Test {
 protected:
  OutputsTest() {
    std::string name = testing::TempDir() + "/luxfield-XXXXXX";
    folder_ = ::mkdtemp(name.data());
  }
  ~OutputsTest() override { fs::remove_all(folder_); }

  std::vector<std::string> Files() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_))
      names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
  }
  void Write(const std::string& name, const std::string& bytes) const {
    WriteFileAtomically(folder_ / name, bytes);
  }
  // A file as a process `pid` that no longer has it open leaves it.
  void Leave(const std::string& name) const { std::ofstream(folder_ / name) << "half"; }

  fs::path folder_;
};

// The process id of a process that has ended and been waited for.
pid_t DeadProcess() {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(0);
  ::waitpid(child, nullptr, 0);
  return child;
}

TEST_F(OutputsTest, ComeIntoBeingTogether) {
  Outputs outputs;
  Write("a.txt", "a");
  WriteAtomically(folder_ / "b.txt", [](const fs::path& temporary) {
    EXPECT_EQ(temporary.extension(), ".txt");
    std::ofstream(temporary) << "b";
  });
  EXPECT_FALSE(fs::exists(folder_ / "a.txt"));
  EXPECT_FALSE(fs::exists(folder_ / "b.txt"));
  EXPECT_EQ(ReadFile(ReadableAt(folder_ / "b.txt")), "b");
  outputs.PutInPlace();
  EXPECT_EQ(ReadableAt(folder_ / "b.txt"), folder_ / "b.txt");
  EXPECT_THAT(Files(), ElementsAre("a.txt", "b.txt"));
  EXPECT_EQ(ReadFile(folder_ / "a.txt") + ReadFile(folder_ / "b.txt"), "ab");
  Write("c.txt", "c");
  outputs.PutInPlace();  // the next frame of a sequence
  EXPECT_THAT(Files(), ElementsAre("a.txt", "b.txt", "c.txt"));
}

TEST_F(OutputsTest, OfAFailureLeaveNothingAndWhatWasThereStays) {
  Write("a.txt", "old");
  {
    const Outputs outputs;
    Write("a.txt", "new");
    Write("b.txt", "new");
  }
  EXPECT_THAT(Files(), ElementsAre("a.txt"));
  EXPECT_EQ(ReadFile(folder_ / "a.txt"), "old");
}

// The third rename fails, as a folder or a pipe has the name: those before it are undone, of a file
// that was there and of one that was not.
TEST_F(OutputsTest, ARenameThatFailsUndoesThoseBeforeIt) {
  for (const bool pipe : {false, true}) {
    fs::remove(folder_ / "taken");
    Write("old.txt", "old");
    Outputs outputs;
    Write("old.txt", "new");
    Write("fresh.txt", "new");
    Write("taken", "new");
    Write("never.txt", "new");
    if (pipe)
      ::mkfifo((folder_ / "taken").c_str(), 0600);
    else
      fs::create_directory(folder_ / "taken");
    EXPECT_THROW(outputs.PutInPlace(), InputError);
    EXPECT_EQ(fs::is_fifo(folder_ / "taken"), pipe);
  }
  EXPECT_THAT(Files(), ElementsAre("old.txt", "taken"));
  EXPECT_EQ(ReadFile(folder_ / "old.txt"), "old");
}

// Without descriptors the folder cannot be opened: whether the files would outlive a power failure is
// not known.
TEST_F(OutputsTest, AFolderThatCannotBeSyncedUndoesTheRenames) {
  Write("old.txt", "old");
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  {
    Outputs outputs;
    Write("old.txt", "new");
    Write("fresh.txt", "new");
    SetStorageHookForTest([&](std::string_view step) {
      const rlimit none{0, before.rlim_max};
      if (step == "renamed") ::setrlimit(RLIMIT_NOFILE, &none);
    });
    EXPECT_THROW(outputs.PutInPlace(), DeviceError);
    SetStorageHookForTest({});
    ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &before), 0);
  }
  EXPECT_THAT(Files(), ElementsAre("old.txt"));
  EXPECT_EQ(ReadFile(folder_ / "old.txt"), "old");
}

TEST_F(OutputsTest, TwoOfOneNameAreRefused) {
  Outputs outputs;
  Write("a.txt", "1");
  EXPECT_THROW(WriteFileAtomically(folder_ / "." / "a.txt", "2"), InputError);
}

TEST_F(OutputsTest, ScratchIsThereAtOnce) {
  const Outputs outputs;
  Write("output.txt", "1");
  {
    const WritesAtOnce scratch;
    Write("scratch.txt", "2");
    EXPECT_EQ(ReadFile(folder_ / "scratch.txt"), "2");
  }
  Write("later.txt", "3");
  EXPECT_FALSE(fs::exists(folder_ / "later.txt"));
}

// Killed at any step but between the renames a process leaves all files or none; what it leaves
// beside them the next one sweeps.
TEST_F(OutputsTest, KilledAtAnyStepAndSwept) {
  int steps = 0;
  for (bool killed = true; killed; ++steps) {
    const pid_t child = ::fork();
    if (child == 0) {
      int left = steps;
      SetStorageHookForTest([&](std::string_view) {
        if (left-- == 0) ::raise(SIGKILL);
      });
      Outputs outputs;
      Write("a.txt", "a");
      Write("b.txt", "b");
      outputs.PutInPlace();
      ::_exit(0);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    killed = WIFSIGNALED(status);
    const bool between = steps == 4;  // written, written, synced, synced, renamed, renamed
    EXPECT_EQ(fs::exists(folder_ / "a.txt"), steps >= 4) << steps;
    EXPECT_EQ(fs::exists(folder_ / "b.txt"), steps >= 4 && !between) << steps;
    Outputs next;
    Write("next.txt", "n");
    next.PutInPlace();
    for (const std::string& name : Files()) {
      EXPECT_FALSE(name.starts_with(".")) << name << " after a kill at step " << steps;
      fs::remove(folder_ / name);
    }
  }
  EXPECT_EQ(steps, 8);  // the two renames, "outputs in place", and the one that is not killed
}

TEST_F(OutputsTest, OnlyWhatKilledProcessesLeftIsSwept) {
  const pid_t dead = DeadProcess();
  const auto name = [](pid_t pid, const char* rest) {
    return fmt::format(".x.{}-0.{}", pid, rest);
  };
  Leave(name(dead, "tmp.exr"));
  Leave(name(dead, "tmp"));
  Leave(fmt::format("..hidden.meas.{}-17.tmp.exr", dead));
  const std::vector<std::string> stay = {name(dead, "tmp.exr.bak"),
                                         name(dead, "tmpx"),
                                         fmt::format("x.{}-0.tmp.exr", dead),
                                         ".x.tmp.exr",
                                         ".x.-1-0.tmp.exr",
                                         ".x.0-0.tmp.exr",
                                         fmt::format(".x.{}.tmp.exr", dead),
                                         name(::getppid(), "tmp.exr")};  // which lives
  for (const std::string& file : stay) Leave(file);
  const auto link = fmt::format(".link.{}-0.tmp.exr", dead), held = name(dead, "tmp.held");
  fs::create_symlink(folder_ / stay[0], folder_ / link);
  Leave(held);
  const int holder = ::open((folder_ / held).c_str(), O_RDONLY);  // as from another container
  ASSERT_EQ(::flock(holder, LOCK_EX | LOCK_NB), 0);
  SweepTemporaries(folder_);
  auto expected = stay;
  expected.insert(expected.end(), {link, held});
  EXPECT_THAT(Files(), testing::UnorderedElementsAreArray(expected));
  // A process id in use says nothing of a file that nobody has touched for a day.
  const timespec day_ago[] = {{std::time(nullptr) - 24 * 3600 - 60, 0},
                              {std::time(nullptr) - 24 * 3600 - 60, 0}};
  for (const std::string& file : {stay.back(), held})
    ASSERT_EQ(::utimensat(AT_FDCWD, (folder_ / file).c_str(), day_ago, 0), 0);
  SweepTemporaries(folder_);
  expected.erase(std::find(expected.begin(), expected.end(), stay.back()));
  EXPECT_THAT(Files(), testing::UnorderedElementsAreArray(expected));
  ::close(holder);
}

// What a living writer has staged is never swept, however old.
TEST_F(OutputsTest, WhatWaitsIsLocked) {
  Outputs outputs;
  Write("a.txt", "a");
  const auto waiting = Files();
  ASSERT_EQ(waiting.size(), 1u);
  const timespec long_ago[] = {{0, 0}, {0, 0}};
  ASSERT_EQ(::utimensat(AT_FDCWD, (folder_ / waiting[0]).c_str(), long_ago, 0), 0);
  SweepTemporaries(folder_);
  EXPECT_EQ(Files(), waiting);
  outputs.PutInPlace();
  EXPECT_THAT(Files(), ElementsAre("a.txt"));
}

// What only saves time: with the folders above it, at once while a verb's outputs wait, and no error
// where there is no place for it.
TEST_F(OutputsTest, ACacheFileIsThereAtOnceOrNotAtAll) {
  const Outputs outputs;
  const fs::path file = folder_ / "deep" / "er" / "cached";
  EXPECT_TRUE(WriteCacheFile(file, "kernel"));
  EXPECT_EQ(ReadFile(file), "kernel");
  EXPECT_TRUE(WriteCacheFile(file, "newer"));
  EXPECT_EQ(ReadFile(file), "newer");
  Leave("file");
  EXPECT_FALSE(WriteCacheFile(folder_ / "file" / "cached", "kernel"));
  EXPECT_THAT(Files(), ElementsAre("deep", "file"));
}

TEST_F(OutputsTest, OnlyFilesWithTheMarkAreOnesOwn) {
  const std::string far(std::size_t{1} << 20, 'x');  // as much as is read at once
  RequireOwn(folder_ / "absent", "lamp.rad", "mark");
  for (const std::string& own : {std::string("mark"), far + "mark", far.substr(2) + "mark" + far,
                                 far.substr(1) + "mamark"}) {
    Write("a.dat", own);
    EXPECT_NO_THROW(RequireOwn(folder_ / "a.dat", "lamp.rad", "mark"));
  }
  ::mkfifo((folder_ / "fifo").c_str(), 0600);
  EXPECT_THROW(RequireOwn(folder_ / "fifo", "lamp.rad", "mark"), InputError);
  for (const auto& [other, kind] :
       {std::pair{std::string(), "no file that luxfield knows"},
        std::pair{far + "mar" + far + "k", "no file that luxfield knows"},
        std::pair{std::string("\xf2\x03\0\0", 4), "a ray file of TM-25, Zemax"}}) {
    Write("a.dat", other);
    try {
      RequireOwn(folder_ / "a.dat", "there/lamp.rad", "mark");
      ADD_FAILURE();
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(std::string("a.dat: is ") + kind));
      EXPECT_THAT(error.what(), testing::HasSubstr("a file that belongs to lamp.rad would come"));
    }
  }
}

TEST_F(OutputsTest, PlacesThatTakeNoFile) {
  Leave("file");
  ::mkfifo((folder_ / "fifo").c_str(), 0600);
  EXPECT_NO_THROW(RequireOutputPlace(folder_ / "new"));
  EXPECT_NO_THROW(RequireOutputPlace(folder_ / "file"));
  EXPECT_NO_THROW(RequireOutputPlace("in_this_folder"));
  for (const auto& [path, said] :
       {std::pair{folder_ / "absent" / "x", "there is no folder"},
        std::pair{folder_ / "file" / "x", "is no folder"},
        std::pair{folder_, "is a folder, not a file to write"},
        std::pair{folder_ / "fifo", "is no file that can be replaced"}}) {
    try {
      RequireOutputPlace(path);
      ADD_FAILURE() << path;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(said));
    }
  }
  EXPECT_THROW(RequireOutputPlace("/proc/self/x"), DeviceError);
}

}  // namespace
}  // namespace luxfield::core

#include "luxfield/render/device/device.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/render/device/program_cache.h"
#include "luxfield/render/device/program_list.h"
#include "luxfield/render/device/programs_ahead.h"

namespace luxfield::render {
namespace {

constexpr char kScale[] = R"(
typedef struct { float factor; int offset; } Options;
__kernel void Scale(__global const float* in, __global float* out, Options options, int count) {
  const int i = get_global_id(0);
  if (i < count) out[i] = options.factor * in[i] + options.offset;
}
)";

struct Options {
  float factor;
  cl_int offset;
};

// Points the program cache at a fresh folder for one test.
class DeviceTest : public testing::Test {
 protected:
  // PoCL keeps a cache of its own there too, from the first call of the process on: it must outlive
  // the tests.
  static void SetUpTestSuite() {
    ::setenv("POCL_CACHE_DIR", (testing::TempDir() + "/luxfield_pocl_cache").c_str(), 0);
    Device::Open();
  }
  void SetUp() override {
    cache_ = std::filesystem::path(testing::TempDir()) /
             ("luxfield_device_" +
              std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::remove_all(cache_);
    if (const char* old = std::getenv("XDG_CACHE_HOME")) old_ = old;
    ::setenv("XDG_CACHE_HOME", cache_.c_str(), 1);
    // So that ours is used with PoCL.
    ::setenv("POCL_KERNEL_CACHE", "0", 1);
  }
  void TearDown() override {
    ::unsetenv("POCL_KERNEL_CACHE");
    if (old_.empty())
      ::unsetenv("XDG_CACHE_HOME");
    else
      ::setenv("XDG_CACHE_HOME", old_.c_str(), 1);
    std::filesystem::remove_all(cache_);
  }
  std::filesystem::path CachedFile() const {
    for (const auto& entry : std::filesystem::directory_iterator(cache_ / "luxfield/store"))
      return entry.path();
    return {};
  }
  std::filesystem::path cache_;
  std::string old_;
};

std::vector<float> RunScale(const Device& device, const Program& program) {
  const std::vector<float> in = {1, 2, 3, 4, 5};
  const auto input = Buffer::From(device, in);
  const Buffer output(device, in.size() * sizeof(float));
  Kernel kernel(program, "Scale");
  kernel.Set(input, output, Options{2, 1}, cl_int{5});
  EXPECT_GE(kernel.Enqueue({in.size()}, {4}).Seconds(), 0.0);
  return output.Download<float>();
}

TEST_F(DeviceTest, RunsAKernelWithTypedArgumentsAndRoundsTheWorkUp) {
  const auto device = Device::Open();
  EXPECT_THAT(RunScale(device, Program::BuildText(device, kScale, "scale")),
              testing::ElementsAre(3, 5, 7, 9, 11));
}

// Kernels cut otherwise or from another text are other programs.
TEST_F(DeviceTest, BuildsAProgramOnce) {
  const auto device = Device::Open();
  const auto program = Program::BuildText(device, kScale, "scale");
  EXPECT_EQ(Program::BuildText(device, kScale, "scale").get(), program.get());
  const Device copy = device;  // NOLINT(performance-unnecessary-copy-initialization)
  EXPECT_EQ(Program::BuildText(copy, kScale, "scale").get(), program.get());
  EXPECT_NE(Program::BuildText(device, kScale, "scale", "-DOTHER=1").get(), program.get());
  EXPECT_NE(Program::BuildText(device, std::string(kScale) + "\n", "scale").get(), program.get());
  DeviceTuning tuning = device.tuning();
  tuning.lanes = tuning.lanes == 8 ? 4 : 8;
  EXPECT_NE(Program::BuildText(device.WithTuning(tuning), kScale, "scale").get(), program.get());
  // Kernels of one program keep arguments of their own.
  EXPECT_THAT(RunScale(device, program), testing::ElementsAre(3, 5, 7, 9, 11));
  EXPECT_THAT(RunScale(copy, program), testing::ElementsAre(3, 5, 7, 9, 11));
}

TEST_F(DeviceTest, ReadsItsBinaryBackAndIgnoresADamagedOne) {
  const auto build = [](const std::string& options = {}) {
    return Program::BuildText(Device::Open(), kScale, "scale", options);
  };
  EXPECT_FALSE(build().from_cache());
  const auto again = build();
  EXPECT_TRUE(again.from_cache());
  EXPECT_THAT(RunScale(again.device(), again), testing::ElementsAre(3, 5, 7, 9, 11));
  EXPECT_FALSE(build("-DOTHER=1").from_cache());

  std::filesystem::remove_all(cache_);
  EXPECT_FALSE(build().from_cache());
  {
    std::fstream file(CachedFile(), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(200);
    file.put('\x7f');
    file.put('\x01');
  }
  const auto rebuilt = build();
  EXPECT_FALSE(rebuilt.from_cache());
  EXPECT_THAT(RunScale(rebuilt.device(), rebuilt), testing::ElementsAre(3, 5, 7, 9, 11));
  std::filesystem::resize_file(CachedFile(), 10);
  EXPECT_FALSE(build().from_cache());
}

TEST_F(DeviceTest, LeavesItToPoclToKeepKernels) {
  ::unsetenv("POCL_KERNEL_CACHE");
  for (int run = 0; run < 2; ++run) {
    const auto device = Device::Open();
    const auto program = Program::BuildText(device, kScale, "scale");
    EXPECT_THAT(RunScale(device, program), testing::ElementsAre(3, 5, 7, 9, 11));
    EXPECT_EQ(program.from_cache(),
              run > 0 && device.info().platform != "Portable Computing Language");
  }
}

TEST_F(DeviceTest, TheCacheIsKeyedByDeviceDriverOptionsAndSource) {
  const DeviceInfo info = Device::Open().info();
  const std::string key = ProgramKey(info, "-DA=1", "source").text;
  EXPECT_NE(ProgramKey(info, "-DA=2", "source").text, key);
  EXPECT_NE(ProgramKey(info, "-DA=1", "other source").text, key);
  for (auto field :
       {&DeviceInfo::platform, &DeviceInfo::name, &DeviceInfo::version, &DeviceInfo::driver}) {
    DeviceInfo other = info;
    other.*field += " 2";
    EXPECT_NE(ProgramKey(other, "-DA=1", "source").text, key);
  }
}

constexpr char kSelect[] = "kernels/lights/select_lights.cl";

// Programs that are built within some seconds without anyone asking for them.
std::size_t BuiltAhead(const std::string& work, std::size_t wanted) {
  const auto device = Device::Open();
  const ProgramsAhead ahead(device, work);
  for (int tries = 0; tries < 600 && device.programs().count() < wanted; ++tries)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  const std::size_t count = device.programs().count();
  if (wanted > 0) Program::Build(device, kSelect);  // so that it is kept for the next run
  return count;
}

TEST_F(DeviceTest, BuildsAheadWhatAnEarlierRunAskedFor) {
  ::unsetenv("POCL_KERNEL_CACHE");
  if (!KeepsKernelsItself(Device::Open().info())) GTEST_SKIP() << "binaries are kept instead";
  EXPECT_EQ(BuiltAhead("select", 0), 0u);
  {
    const auto device = Device::Open();
    const ProgramsAhead ahead(device, "select");
    Program::Build(device, kSelect);
  }
  EXPECT_EQ(BuiltAhead("select", 1), 1u);
  EXPECT_EQ(BuiltAhead("select", 1), 1u);
  EXPECT_EQ(BuiltAhead("another", 0), 0u);
}

// What a run asked for that then failed is less than the next one needs; names that are none do no harm.
TEST_F(DeviceTest, KeepsNoProgramsOfARunThatFails) {
  ::unsetenv("POCL_KERNEL_CACHE");
  if (!KeepsKernelsItself(Device::Open().info())) GTEST_SKIP() << "binaries are kept instead";
  const auto key = core::KeyOfThisBuild("programs", Device::Open().info().name + "\nfails");
  ASSERT_TRUE(key);
  ASSERT_TRUE(core::PutIntoCache(*key, "kernels/none.cl \nno blank\n"));
  EXPECT_THROW(
      {
        const auto device = Device::Open();
        const ProgramsAhead ahead(device, "fails");
        throw InputError("bad");
      },
      InputError);
  EXPECT_EQ(core::FindInCache(*key), "kernels/none.cl \nno blank\n");
  {
    const auto device = Device::Open();
    const ProgramsAhead ahead(device, "fails");
    Program::Build(device, kSelect);
  }
  EXPECT_EQ(core::FindInCache(*key), std::string(kSelect) + " \n");
}

TEST_F(DeviceTest, CompilesAnewWhatTheDriverRefuses) {
  const auto device = Device::Open();
  const core::CacheKey key = ProgramKey(device.info(), device.tuning().BuildOptions() + " ",
                                        ResolveIncludes(kScale, "scale"));
  EXPECT_FALSE(Program::BuildText(device, kScale, "scale").from_cache());
  const auto good = core::FindInCache(key);
  ASSERT_TRUE(good);
  // A whole entry with something else inside; a truncated binary would abort PoCL, and the entry's
  // hash keeps it from it.
  ASSERT_TRUE(core::PutIntoCache(key, "not a binary of any driver"));
  const auto program = Program::BuildText(Device::Open(), kScale, "scale");
  EXPECT_FALSE(program.from_cache());
  EXPECT_THAT(RunScale(program.device(), program), testing::ElementsAre(3, 5, 7, 9, 11));
  EXPECT_EQ(core::FindInCache(key)->size(), good->size());  // replaced
}

TEST_F(DeviceTest, CountsLaunchesAndDeviceTimePerKernel) {
  const auto device = Device::Open();
  const std::string text = std::string(kScale) + "__kernel void Nothing(int i) {}";
  const auto program = Program::BuildText(device, text, "scale");
  device.TakeKernelTimes();
  RunScale(device, program);
  Kernel nothing(program, "Nothing");
  nothing.Set(cl_int{1});
  double events_s = 0;
  // More than the profile keeps pending.
  for (int k = 0; k < 3000; ++k) events_s += nothing.Enqueue({8}, {4}).Seconds();
  const auto times = device.TakeKernelTimes();
  ASSERT_EQ(times.size(), 2u);
  EXPECT_EQ(times[0].name, "Scale");
  EXPECT_EQ(times[0].launches, 1);
  EXPECT_GT(times[0].device_s, 0);
  EXPECT_EQ(times[1].name, "Nothing");
  EXPECT_EQ(times[1].launches, 3000);
  EXPECT_NEAR(times[1].device_s, events_s, 1e-9 * events_s);
  EXPECT_TRUE(device.TakeKernelTimes().empty());
}

TEST_F(DeviceTest, WorksWithoutAWritableCache) {
  ::setenv("XDG_CACHE_HOME", "/proc/nowhere", 1);
  const auto device = Device::Open();
  EXPECT_THAT(RunScale(device, Program::BuildText(device, kScale, "scale")),
              testing::ElementsAre(3, 5, 7, 9, 11));
}

TEST_F(DeviceTest, SelectsByIndexAndName) {
  const auto devices = ListDevices();
  ASSERT_FALSE(devices.empty());
  const auto& last = devices.back();
  EXPECT_EQ(Device::Open(std::to_string(last.index)).info().name, last.name);
  EXPECT_EQ(Device::Open(devices.front().name.substr(1, 5)).info().index, 0);
  try {
    Device::Open("no such thing");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr(devices.front().name));
  }
  EXPECT_THROW(Device::Open("99999999999999999999"), InputError);
}

// An environment variable for as long as this lives.
class Variable {
 public:
  Variable(const char* name, const char* value) : name_(name) {
    if (const char* before = std::getenv(name)) before_ = before;
    value ? ::setenv(name, value, 1) : ::unsetenv(name);
  }
  ~Variable() { before_ ? ::setenv(name_, before_->c_str(), 1) : ::unsetenv(name_); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* name_;
  std::optional<std::string> before_;
};

// Where the user's cache folder cannot be made, PoCL gets one that is this user's alone; a folder
// that others may write to is passed over.
TEST_F(DeviceTest, PoclGetsACacheWhereTheUserHasNone) {
  ListDevices();  // PoCL reads the variable once: here, as it was
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(testing::TempDir()) / fmt::format("pocl_cache_{}", ::getpid());
  fs::create_directories(folder);
  const auto name = [&](int n) {
    return (folder / fmt::format("luxfield-pocl-{}-{}", ::getuid(), n)).string();
  };
  {
    const Variable temporary("TMPDIR", folder.c_str()), home("XDG_CACHE_HOME", "/dev/null/cache");
    for (const int n : {0, 1}) {
      const Variable cache("POCL_CACHE_DIR", nullptr);
      ListDevices();
      ASSERT_NE(std::getenv("POCL_CACHE_DIR"), nullptr);
      EXPECT_EQ(std::getenv("POCL_CACHE_DIR"), name(n));
      EXPECT_EQ(fs::status(name(n)).permissions(), fs::perms::owner_all);
      fs::permissions(name(n), fs::perms::all);
    }
  }
  fs::remove_all(folder);
}

// Kernels from PoCL's cache are run: one that another user owns, or may write to, is not used.
TEST_F(DeviceTest, PoclUsesNoCacheThatOthersMayFill) {
  ListDevices();  // PoCL reads the variable once: here, as it was
  namespace fs = std::filesystem;
  const fs::path home = fs::path(testing::TempDir()) / fmt::format("pocl_home_{}", ::getpid()),
                 pocl = home / "pocl", other = home / "luxfield/pocl";
  const auto given = [&]() -> std::string {
    const Variable cache("POCL_CACHE_DIR", nullptr), xdg("XDG_CACHE_HOME", home.c_str());
    ListDevices();
    const char* const folder = std::getenv("POCL_CACHE_DIR");
    return folder ? folder : "PoCL's own";
  };
  EXPECT_EQ(given(), "PoCL's own");
  EXPECT_EQ(fs::status(pocl).permissions(), fs::perms::owner_all);
  fs::permissions(pocl, fs::perms::owner_all | fs::perms::group_write);
  EXPECT_EQ(given(), other);
  EXPECT_EQ(fs::status(other).permissions(), fs::perms::owner_all);
  fs::permissions(pocl, fs::perms::owner_all | fs::perms::others_write);
  EXPECT_EQ(given(), other);
  fs::permissions(pocl, fs::perms::owner_all | fs::perms::others_read | fs::perms::group_read);
  EXPECT_EQ(given(), "PoCL's own");
  // Who may rename the folder may put another in its place; not so where names are their owners' alone.
  fs::permissions(home, fs::perms::all);
  EXPECT_THAT(given(), testing::HasSubstr("luxfield-pocl"));
  fs::permissions(home, fs::perms::all | fs::perms::sticky_bit);
  EXPECT_EQ(given(), "PoCL's own");
  fs::permissions(home, fs::perms::owner_all);
  fs::rename(pocl, home / "elsewhere");
  fs::create_symlink(home / "elsewhere", pocl);
  EXPECT_EQ(given(), other);
  fs::remove(pocl);
  fs::rename(home / "elsewhere", pocl);
  if (::geteuid() == 0) {  // only root gives files away
    ASSERT_EQ(::chown(pocl.c_str(), 65534, 65534), 0);
    EXPECT_EQ(given(), other);
    fs::permissions(pocl, fs::perms::all);
    EXPECT_EQ(given(), other);
  }
  fs::remove_all(home);
}

TEST_F(DeviceTest, BuildErrorCarriesTheLogWithFileAndLine) {
  const auto device = Device::Open();
  try {
    Program::BuildText(
        device, "#include \"kernels/scene/bvh.clh\"\n\n__kernel void Broken() { nonsense; }\n",
        "broken.cl");
    FAIL();
  } catch (const DeviceError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("CL_BUILD_PROGRAM_FAILURE"));
    EXPECT_THAT(error.what(), testing::HasSubstr("broken.cl:3"));
    EXPECT_THAT(error.what(), testing::HasSubstr("nonsense"));
  }
}

TEST_F(DeviceTest, MisuseIsADeviceErrorThatNamesTheCode) {
  const auto device = Device::Open();
  const auto program = Program::BuildText(device, kScale, "scale");
  EXPECT_THAT([&] { Kernel(program, "Missing"); },
              testing::ThrowsMessage<DeviceError>(testing::HasSubstr("CL_INVALID_KERNEL_NAME")));
  Kernel kernel(program, "Scale");
  const Buffer buffer(device, 16);
  EXPECT_THAT([&] { kernel.Set(cl_int{1}, buffer, Options{}, cl_int{1}); },
              testing::ThrowsMessage<DeviceError>(testing::HasSubstr("CL_INVALID_ARG_SIZE")));
  EXPECT_THROW(kernel.Set(buffer), DeviceError);
  kernel.Set(buffer, buffer, Options{1, 0}, cl_int{4});
  EXPECT_THROW(kernel.Enqueue({1024}, {device.info().max_work_group_size * 2}), DeviceError);
  EXPECT_THROW(kernel.Enqueue({0}, {1}), DeviceError);
  EXPECT_THROW(Buffer(device, device.info().max_allocation_bytes + 1), DeviceError);
}

TEST_F(DeviceTest, BufferTransfersCheckTheirSizes) {
  const auto device = Device::Open();
  Buffer buffer = Buffer::From(device, std::vector<std::int32_t>{1, 2, 3, 4});
  const std::vector<std::int32_t> two = {7, 8};
  buffer.Upload(std::span(two), 1);
  EXPECT_THAT(buffer.Download<std::int32_t>(), testing::ElementsAre(1, 7, 8, 4));
  EXPECT_THROW(buffer.Upload(std::span(two), 3), DeviceError);
  std::vector<std::int32_t> five(5);
  EXPECT_THROW(buffer.Download(std::span(five)), DeviceError);
  buffer.FillZero();
  EXPECT_THAT(buffer.Download<std::int32_t>(), testing::Each(0));
  EXPECT_TRUE(Buffer(device, 0).Download<float>().empty());
  EXPECT_THROW(Buffer().Upload(std::span(two)), DeviceError);
}

TEST(Tuning, FollowsTheDeviceAndCanBeChanged) {
  DeviceInfo info;
  info.is_cpu = true;
  info.native_float_lanes = 4;
  EXPECT_EQ(TuningOf(info).lanes, 4);
  info.native_float_lanes = 8;
  EXPECT_EQ(TuningOf(info).lanes, 8);
  info.native_float_lanes = 16;
  const DeviceTuning cpu = TuningOf(info);
  EXPECT_EQ(cpu.lanes, 16);
  EXPECT_GT(cpu.pixels_per_item, 1);
  info.is_cpu = false;
  const DeviceTuning gpu = TuningOf(info);
  EXPECT_LT(gpu.pixels_per_item, cpu.pixels_per_item);
  EXPECT_EQ(gpu.group_size % 64, 0);
  EXPECT_EQ(gpu.lanes, 8);
  EXPECT_THAT(gpu.BuildOptions(), testing::Not(testing::HasSubstr("rounded-divide")));
  info.has_exact_divide = true;
  EXPECT_THAT(TuningOf(info).BuildOptions(), testing::HasSubstr("rounded-divide"));
  // Drivers that choose OpenCL C 3.0 themselves refuse kernels of 1.2.
  for (const DeviceTuning& tuning : {cpu, gpu})
    EXPECT_THAT(tuning.BuildOptions(), testing::StartsWith("-cl-std=CL1.2 "));
  EXPECT_EQ(ParseTuning(gpu.Text(), cpu), gpu);
  EXPECT_EQ(ParseTuning("", cpu), cpu);
  EXPECT_EQ(ParseTuning("group=8", cpu).group_size, 8);
  for (const char* wrong :
       {"group=0", "group", "group=", "group=8x", "wave=3", "pixels=6", "pixels=0,shared=0",
        "pixels=9,shared=3", "lanes=3", "=", ",", "group=99999999999"})
    EXPECT_THROW(ParseTuning(wrong, cpu), InputError) << wrong;

  ::setenv("LUXFIELD_TUNING", "group=4", 1);
  const auto device = Device::Open();
  ::unsetenv("LUXFIELD_TUNING");
  EXPECT_EQ(device.tuning().group_size, 4);
  EXPECT_NE(Device::Open().tuning().group_size, 4);
  const auto program = Program::BuildText(
      device,
      "__kernel void Size(__global int* out) { out[get_global_id(0)] = get_local_size(0); }",
      "size");
  const Buffer out(device, 8 * sizeof(cl_int));
  Kernel kernel(program, "Size");
  kernel.Set(out).Enqueue(std::size_t{8});
  EXPECT_THAT(out.Download<cl_int>(), testing::Each(4));
}

// Intel's compiler gives wrong results in groups of more, and wrong pictures.
TEST(Tuning, OfIntelsRuntimeForProcessorsRunsItemsOneByOne) {
  DeviceInfo info;
  info.platform = "Intel(R) OpenCL";
  info.is_cpu = true;
  info.native_float_lanes = 8;
  EXPECT_EQ(TuningOf(info).group_size, 1);
  EXPECT_EQ(TuningOf(info).lanes, 8);
  EXPECT_EQ(ParseTuning("group=32", TuningOf(info)).group_size, 32);
  info.is_cpu = false;  // their GPUs have another compiler
  EXPECT_EQ(TuningOf(info).group_size, 64);
  info = {};
  info.platform = "Portable Computing Language";
  info.is_cpu = true;
  EXPECT_EQ(TuningOf(info).group_size, 32);
}

TEST(ProgramList, HoldsEachProgramOnceAndItsText) {
  const auto& all = AllPrograms();
  EXPECT_EQ(std::set<ProgramName>(all.begin(), all.end()).size(), all.size());
  for (const auto& [path, options] : all) EXPECT_NE(EmbeddedSource(path), "") << path;
}

TEST(ProgramList, IsWhatCanBeBuilt) {
  RequireListed({"kernels/luminaire/volume.cl", ""});
  RequireListed({"kernels/luminaire/exact.cl", " -D  SHADOW_MAPS=1 "});
  EXPECT_THROW(RequireListed({"kernels/luminaire/exact.cl", "-D SHADOW_MAPS=2"}), std::logic_error);
  EXPECT_THROW(Program::Build(Device::Open(), "kernels/none.cl"), std::logic_error);
}

TEST(Includes, AreResolvedOnceWithTheirLines) {
  const std::string text = ResolveIncludes(
      "#include \"bvh.clh\"\n#include \"luxfield/render/kernels/scene/bvh_types.clh\"\nint last;\n",
      "kernels/scene/some.cl");
  EXPECT_THAT(text, testing::StartsWith(
                        "#line 1 \"kernels/scene/some.cl\"\n#line 1 \"kernels/scene/bvh.clh\"\n"));
  EXPECT_THAT(text, testing::HasSubstr("#line 3 \"kernels/scene/some.cl\"\nint last;\n"));
  const auto first = text.find("typedef struct BvhNode");
  ASSERT_NE(first, std::string::npos);
  EXPECT_EQ(text.find("typedef struct BvhNode", first + 1), std::string::npos);
  EXPECT_THROW(ResolveIncludes("#include \"missing.clh\"\n", "some.cl"), DeviceError);
}

TEST(ErrorNames, AreThoseOfTheHeader) {
  EXPECT_EQ(ErrorName(-5), "CL_OUT_OF_RESOURCES");
  EXPECT_EQ(ErrorName(-9999), "OpenCL error -9999");
}

}  // namespace
}  // namespace luxfield::render

// device_bench: cost and error of every estimator on one OpenCL device (docs/testing.md,
// "Estimators on another machine").
//
// The program carries its kernels and its scene, `car2` (render/accuracy/car2.h), and needs nothing
// but an OpenCL driver: copy the file to the machine and run it. Errors are against the closed form
// in double, computed on the host for some pixels. LUXFIELD_TUNING changes how work is cut for the
// device (render/device/device_tuning.h).
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>

#include "luxfield/bench/bench_nearfield.h"
#include "luxfield/core/console.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/render/device/device.h"
#include "luxfield/version.h"

namespace {

using luxfield::render::DeviceInfo;

struct Options {
  luxfield::bench::BenchNearfieldOptions bench;
  std::string json_file;
  bool list = false;
};

void Declare(CLI::App& app, Options& options) {
  auto& bench = options.bench;
  app.add_flag("--list", options.list, "List the OpenCL devices and end");
  app.add_option("--device", bench.device,
                 "A number or a part of a name from --list (default: the first)");
  app.add_option("--estimator", bench.estimators, "Estimators by name (default: all)");
  app.add_option("--spp", bench.samples_per_pixel, "Light samples per pixel to try")
      ->capture_default_str();
  app.add_option("--width", bench.width, "Picture width, pixels")->capture_default_str();
  app.add_option("--height", bench.height, "Picture height, pixels")->capture_default_str();
  app.add_option("--grid-width", bench.car2.grid_width, "Coefficient images across")
      ->capture_default_str();
  app.add_option("--grid-height", bench.car2.grid_height, "Coefficient images down")
      ->capture_default_str();
  app.add_option("--size", bench.car2.size, "Texels across and down an image")
      ->capture_default_str();
  app.add_option("--channels", bench.car2.channels, "1 or 3")->capture_default_str();
  app.add_option("--repeats", bench.repeats, "Timed runs; the median counts")
      ->capture_default_str();
  app.add_option("--reference-pixels", bench.reference_pixels,
                 "Random pixels that errors are taken over, 0 for all")
      ->capture_default_str();
  app.add_option("--threads", bench.threads, "Threads of the host and of an OpenCL CPU device");
  app.add_option("--json", options.json_file, "Write the figures to this file");
}

void PrintDevice(const DeviceInfo& info) {
  fmt::print("{}: {}, {}\n   driver {}, {} compute units, {:.1f} GiB{}\n", info.index, info.name,
             info.version, info.driver, info.compute_units,
             static_cast<double>(info.global_memory_bytes) / 0x1p30, info.has_fp64 ? ", fp64" : "");
}

void PrintRows(const nlohmann::json& rows) {
  fmt::print("{:<12} {:>6} {:>10} {:>10} {:>10} {:>10} {:>10} {:>10}\n", "estimator", "spp",
             "wall ms", "device ms", "core-s", "Msample/s", "rel RMSE", "bias");
  for (const auto& row : rows)
    fmt::print("{:<12} {:>6} {:>10.2f} {:>10.2f} {:>10.3f} {:>10.1f} {:>10.2e} {:>10.2e}\n",
               row["estimator"].get<std::string>(), row["spp"].get<int>(),
               1e3 / row["fps"].get<double>(), 1e3 * row["device_s"].get<double>(),
               row["core_s"].get<double>(), 1e-6 * row["samples_per_s"].get<double>(),
               row["rel_rmse"].get<double>(), row["bias"].get<double>());
}

int Run(const Options& options) {
  if (options.list) {
    for (const auto& info : luxfield::render::ListDevices()) PrintDevice(info);
    return 0;
  }
  const auto device = luxfield::render::Device::Open(options.bench.device, options.bench.threads);
  const DeviceInfo& info = device.info();
  PrintDevice(info);
  fmt::print("   tuning {}\n", device.tuning().Text());
  const nlohmann::json rows = luxfield::bench::BenchNearfield(options.bench);
  PrintRows(rows);
  if (!options.json_file.empty())
    luxfield::core::WriteFileAtomically(options.json_file,
                                        nlohmann::json{{"device", info.name},
                                                       {"platform", info.platform},
                                                       {"opencl", info.version},
                                                       {"driver", info.driver},
                                                       {"tuning", device.tuning().Text()},
                                                       {"version", LUXFIELD_VERSION},
                                                       {"rows", rows}}
                                                .dump(2) +
                                            "\n");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Cost and error of luxfield's estimators on an OpenCL device");
  Options options;
  options.bench.samples_per_pixel = {50, 200, 1000};
  options.bench.reference_pixels = 500;
  Declare(app, options);
  try {
    app.parse(argc, argv);
    int code = 0;
    luxfield::core::RunWith(luxfield::core::OnConsole(false, options.bench.threads),
                            [&] { code = Run(options); });
    return code;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const luxfield::Error& error) {
    fmt::print(stderr, "device_bench: {}\n", error.what());
    return error.exit_code();
  } catch (const std::exception& error) {
    fmt::print(stderr, "device_bench: {}\n", error.what());
    return 1;
  }
}

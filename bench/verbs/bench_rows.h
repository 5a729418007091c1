// What benches have in common: rows as a table, and an OpenCL device to run on.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "luxfield/cli/program.h"
#include "luxfield/render/device/device.h"

namespace luxfield::bench {

// Rows as an aligned table: numbers to four digits; lists are for --json. `columns` empty: all of
// the first row's.
void PrintRows(const core::Json& rows, const std::vector<std::string>& columns);

// The processor, as a bench on host threads names its device.
std::string CpuName();

// Prints them, and returns them with the device and the threads.
core::Json Finish(const core::Json& rows, const std::string& device,
                  const std::vector<std::string>& columns = {});

// The same of a bench on an OpenCL device; `how` are its options.
template <typename Options>
core::Json FinishOnDevice(const core::Json& rows, const Options& how,
                          const std::vector<std::string>& columns = {}) {
  return Finish(rows, render::Device::Open(how.device, how.threads).info().name, columns);
}

template <typename Options>
struct Bench {
  CLI::App& app;
  Options& how;
};

// A bench on an OpenCL device: `run` gets its options, which the caller makes settable, with the
// device and the threads asked for.
template <typename Options, typename Run>
Bench<Options> AddDeviceBench(cli::Program& program, CLI::App& benches, const std::string& name,
                              const std::string& description, Run run) {
  auto how = std::make_shared<Options>();
  CLI::App& app = program.AddVerb(benches, name, description, [how, run, &program] {
    how->threads = program.common().threads;
    return run(*how);
  });
  app.add_option("--device", how->device, "OpenCL device (default: the first)");
  return {app, *how};
}

}  // namespace luxfield::bench

// Programs built in a thread of their own before they are asked for: those that an earlier run of the
// same work asked for. PoCL, which keeps compiled kernels itself, reads the whole source of each program
// to find them, some 70 ms; meanwhile the scene is read and its tables are made. Of other drivers
// binaries are kept, which load at once, and nothing is built ahead.
//
//   const render::Device device = render::Device::Open();
//   const render::ProgramsAhead ahead(device, "render cells traced street.toml");
//   ... Program::Build finds what is built, and waits for what is being built
//
// Which programs they are is kept under the name of the work (core/cache.h) when this ends. A wrong
// name costs the time of another core, nothing else; no result depends on it.
#pragma once

#include <exception>
#include <optional>
#include <string>
#include <thread>

#include "luxfield/core/cache.h"
#include "luxfield/render/device/device.h"

namespace luxfield::render {

class ProgramsAhead {
 public:
  // `work` names what is done with the device; one line.
  ProgramsAhead(const Device& device, const std::string& work);
  ~ProgramsAhead();  // ends after the program that is being built
  ProgramsAhead(const ProgramsAhead&) = delete;
  ProgramsAhead& operator=(const ProgramsAhead&) = delete;

 private:
  Device device_;
  std::optional<core::CacheKey> key_;                    // none: nothing is kept between runs
  std::string kept_;                                     // the list of an earlier run
  int running_exceptions_ = std::uncaught_exceptions();  // a run that failed is not kept
  std::jthread thread_;
};

}  // namespace luxfield::render

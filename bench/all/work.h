// What `luxfield bench all` measures: named work, held against a target.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace luxfield::bench {

struct AllOptions {
  int runs = 5;  // of each work; the median counts
  // scene.toml files, which are lit by lamps that lie in ../../out/lamps from there.
  std::filesystem::path scenes = "data/scenes";
  std::filesystem::path folder;    // scratch: 2 GB
  std::vector<std::string> works;  // those whose names contain one of these; empty: all
  std::string device;              // as --device
  int threads = 0;                 // of an OpenCL CPU device, 0: all
};

struct Work {
  std::string name, unit;
  double target = 0;
  bool more_is_better = false;
};

// What some runs of a work gave.
struct Figures {
  std::vector<double> runs;      // in the work's unit; empty: not measured, and `limit` says why
  std::optional<double> target;  // where it follows from what was measured in the same run
  std::string peer;              // what does the same, or bounds it; empty: nothing
  std::optional<double> peer_value;  // in the work's unit
  std::string limit;                 // at which size and error, and what bounds it
  std::optional<double> core_s;      // processor time of a run that `runs` states the wall time of
};

// Works that are measured together. `measure` gives the figures of each of them, in their order;
// where it throws an Error, none of them could be measured.
struct WorkGroup {
  std::vector<Work> works;
  std::function<std::vector<Figures>(const AllOptions&)> measure;
};

// Rays against Embree (bench/bench_rays.h).
std::vector<WorkGroup> RayWorks();
// Lighting of resident scenes: estimators, shadows, draws, tables, many lamps.
std::vector<WorkGroup> LightingWorks();
// Measurements to light fields: solve, merge, reconstruct.
std::vector<WorkGroup> ReconstructionWorks();
// What a user waits for: programs as they are started.
std::vector<WorkGroup> ProgramWorks();

}  // namespace luxfield::bench

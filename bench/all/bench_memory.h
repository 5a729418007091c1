// `luxfield bench memory`: what memory verbs take that work within a limit, beside the disk.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace luxfield::bench {

struct BenchMemoryOptions {
  std::filesystem::path folder;           // scratch
  std::vector<std::string> works;         // those whose names start so; empty: all
  std::vector<int> grids{7, 10, 14, 20};  // square grids of filters: 49 to 400 positions
  int texels = 512;                       // along a side of an image
  std::string memory = "512M";            // as for --memory of the verbs
  // Share of an image's rows that hold light. The others are 0, and measurements are packed where
  // there are such rows, so that sessions larger than the disk can be had.
  double filled = 1;
  int runs = 1;  // of each work; the median by core seconds counts
};

// Rows, of programs as users start them:
//   work       "merge" of a session of two exposures on a sensor of `texels` along a side, to images
//              of a quarter of them; "reconstruct" and "reconstruct --non-negative", with sigma, of
//              other measurements; "preprocess" of what the first of these makes; "render exact"
//              and "render volume", pictures of 512 x 384 lit by a headlight of as many images
//              (WriteCarField), whose table is built where the cache lacks it
//   positions, mpix (of `texels` squared), read_mib, written_mib, wall_s, core_s, peak_mib
//   disk_s     as many bytes written durably and read from the disk, a plain file, once before each
//              row: at most 1 GiB of each, in proportion
// Throws InputError for options that make no sense, DeviceError for the disk.
nlohmann::json BenchMemory(const BenchMemoryOptions& options);

}  // namespace luxfield::bench

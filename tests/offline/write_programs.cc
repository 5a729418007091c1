// write_programs FOLDER: every program of the renderer as FOLDER/N.cl with includes in place, and a line
// "N<tab>path<tab>options" for each on stdout, its options those of a GPU.
#include <fmt/format.h>

#include <exception>
#include <filesystem>
#include <fstream>

#include "luxfield/render/device/program_list.h"

using namespace luxfield::render;

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  try {
    DeviceInfo gpu;
    gpu.has_exact_divide = true;
    int n = 0;
    for (const auto& [path, options] : AllPrograms()) {
      std::ofstream out(std::filesystem::path(argv[1]) / fmt::format("{}.cl", n));
      out << ResolveIncludes(EmbeddedSource(path), path);
      if (!out.flush()) throw std::runtime_error(fmt::format("{}: cannot be written", argv[1]));
      fmt::print("{}\t{}\t{} {}\n", n++, path, TuningOf(gpu).BuildOptions(), options);
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}

// A task whose pieces are EXR rows of numbers that say where they are, and that fails where it is told.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>

#include "luxfield/core/exr.h"
#include "luxfield/core/file.h"
#include "luxfield/shard/join_exr.h"
#include "luxfield/shard/task.h"

namespace luxfield::shard {

class FakeTask : public Task {
 public:
  static constexpr int kWidth = 5;

  FakeTask(std::filesystem::path folder, int rows) : folder_(std::move(folder)), rows_(rows) {
    input = folder_ / "input.txt";
    if (!std::filesystem::exists(input)) core::WriteFileAtomically(input, "numbers");
  }

  std::string Axis() const override { return "rows"; }
  int Length() const override { return rows_; }
  int Grain() const override { return grain; }
  std::vector<std::filesystem::path> Inputs() const override { return {input}; }
  core::Json Whole() const override { return core::Json::object(); }
  std::vector<std::string> Endings(int, int) const override { return {".exr"}; }
  core::Json Run(const core::Json&, int first, int last,
                 std::span<const std::filesystem::path> files) const override {
    ++runs;
    if (before_write) before_write(first);
    Write(files[0], first, last);
    return {{"first", first}};
  }
  void Join(const core::Json&, std::span<const Piece> pieces) const override {
    std::vector<std::filesystem::path> files;
    for (const Piece& piece : pieces) files.push_back(piece.files[0]);
    JoinExrRows(files, Outputs()[0], core::ExrCompression::kZip);
  }
  std::vector<std::filesystem::path> Outputs() const override { return {folder_ / "joined.exr"}; }

  // Rows first to last - 1; all of them are the whole.
  void Write(const std::filesystem::path& file, int first, int last) const {
    std::vector<float> pixels;
    std::vector<std::uint32_t> marks;
    for (int k = first * kWidth; k < last * kWidth; ++k) {
      pixels.push_back(0.1f * static_cast<float>(k));
      marks.push_back(static_cast<std::uint32_t>(k * k));
    }
    core::ExrPartView part{"", kWidth, last - first, {}, {{"luxfield:made_by", made_by}}};
    part.channels = {{"Y", std::span<const float>(pixels)},
                     {"marks", std::span<const std::uint32_t>(marks)}};
    core::WriteExr(file, std::span(&part, 1));
  }

  std::filesystem::path input;
  int grain = 1;
  std::string made_by = "a test";
  std::function<void(int first)> before_write;
  mutable int runs = 0;

 private:
  std::filesystem::path folder_;
  int rows_;
};

inline std::string BytesOf(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace luxfield::shard

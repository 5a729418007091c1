// A dynamic environment: frames of radiance from infinitely far, one after the other
// (docs/theory.md 8).
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "luxfield/environment/cube_map.h"
#include "luxfield/environment/environment_layouts.h"

namespace luxfield::environment {

// Whether numbers in two names count as numbers: "sky_9" comes before "sky_10". Names that differ
// in leading zeros only keep the order of their characters.
bool NaturallyBefore(std::string_view a, std::string_view b);

// Whether a path names a sequence and not one picture: a folder, or a list (.txt).
bool IsEnvironmentSequence(const std::filesystem::path& path);

// The frames of a folder, its .hdr, .rgbe, .pic and .exr files in natural order, or of a list: a
// text file with a path a line, relative to it, in its own order; empty lines and those that begin
// with # are skipped. Throws InputError naming folder or line: no frames, no such file.
std::vector<std::filesystem::path> ListEnvironmentFrames(const std::filesystem::path& path);

struct EnvironmentSequenceOptions {
  std::optional<EnvironmentLayout> layout;  // as in ReadEnvironmentPicture
  int face_size = 0;                        // 0: DefaultFaceSize of the frames
  int read_ahead = 2;                       // cube maps made ahead of the caller, at least 1
};

// Streams a sequence: a thread of its own reads, checks and resamples frames while the caller uses
// the one before. Nothing but the resampling weights is computed beforehand, once for all frames,
// which therefore must agree in size, layout and registration. Memory, besides the weights:
// read_ahead + 1 cube maps of 72 N^2 bytes and one frame as it is in its file. A frame's time is
// that of reading and decoding: 1024 x 512 with N = 256 take 40 ms (.exr) or 25 ms (.hdr).
class EnvironmentSequence {
 public:
  // Reads the first frame for its size. Throws InputError as ListEnvironmentFrames,
  // ReadEnvironmentPicture and CubeResampler, or if read_ahead is below 1.
  explicit EnvironmentSequence(const std::filesystem::path& path,
                               const EnvironmentSequenceOptions& options = {});
  ~EnvironmentSequence();
  EnvironmentSequence(EnvironmentSequence&&) noexcept;
  EnvironmentSequence& operator=(EnvironmentSequence&&) noexcept;

  const std::vector<std::filesystem::path>& frames() const;
  EnvironmentLayout layout() const;
  int width() const;  // of the frames as they are in their files
  int height() const;
  int face_size() const;

  // The next frame into `cube`; false after the last one. Throws InputError naming the frame that
  // cannot be read or differs from the first, at its turn and again at every later call.
  bool Next(CubeMap& cube);
  // Begin at a frame, the first if none is named: what comes before it is not read.
  void Rewind(std::size_t frame = 0);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace luxfield::environment

// A video that the program ffmpeg makes of pictures.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <span>

namespace luxfield::view {

// Whether a file of that name is a video: .mp4, .mkv, .mov, .webm.
bool IsVideoName(const std::filesystem::path& path);

// Runs `ffmpeg`, found by $PATH, with pictures on its standard input.
class VideoFile {
 public:
  // Of pictures of width x height pixels. Throws DeviceError where ffmpeg cannot be started.
  VideoFile(const std::filesystem::path& path, int width, int height, double frames_per_s);
  ~VideoFile();  // ends ffmpeg where Finish was not called
  VideoFile(const VideoFile&) = delete;
  VideoFile& operator=(const VideoFile&) = delete;

  // Red, green, blue, 255 of every pixel, sRGB, row 0 on top. Throws DeviceError where ffmpeg has
  // ended.
  void Add(std::span<const std::uint8_t> rgba);
  // Waits until the file is whole; throws DeviceError where ffmpeg failed.
  void Finish();

 private:
  pid_t ffmpeg_ = -1;
  int pictures_ = -1;  // the pipe's end
};

}  // namespace luxfield::view

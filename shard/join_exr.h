// OpenEXR files that are pieces of one, joined without a change of a bit.
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>

#include "luxfield/core/exr.h"

namespace luxfield::shard {

// What is done to a channel's pixels before they are written: those of all rows.
using MendChannel =
    std::function<void(int part, const std::string& channel, std::span<float> pixels)>;

// Files of the same parts, whose pictures are the rows of the output's one below the other. One part
// of the output is in memory at a time. Throws InputError where parts, channels or attributes of the
// files differ.
void JoinExrRows(std::span<const std::filesystem::path> files, const std::filesystem::path& output,
                 core::ExrCompression compression, const MendChannel& mend = {});

// Files that hold the parts of the output, one file's after the other's, and `more` behind them.
void JoinExrParts(std::span<const std::filesystem::path> files, const std::filesystem::path& output,
                  core::ExrCompression compression, std::span<const core::ExrPartView> more = {});

}  // namespace luxfield::shard

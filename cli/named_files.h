// Files that options name: of the kind that a verb takes, and where they can be written.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/core/file_kind.h"
#include "luxfield/scene/scene.h"

namespace luxfield::cli {

// Throws InputError where the file is of a kind that core::WhatIs knows and that is not among
// `taken`: says what it is, what makes a file of the kind asked for, and which verb takes the one
// given. Files of unknown kind are left to their reader.
void RequireKind(const std::filesystem::path& path, const std::vector<core::FileKind>& taken);

// The same as a check of an option.
CLI::Validator InputFile(std::vector<core::FileKind> taken);

// Sessions, or calibrations, of all kinds.
CLI::Validator InputSession();
CLI::Validator InputCalibration();

// Of an option that names a file to write: that it can be written (core::RequireOutputPlace).
CLI::Validator OutputFile();

// Of an option that gives NAME of several files NAME.ENDING: that there is one behind the folder,
// and that NAME`first_ending` can be written.
CLI::Validator OutputName(std::string first_ending);

// Throws InputError where a light field of the scene is absent, or is a file of another kind.
void RequireLuminaires(const scene::Scene& scene);

}  // namespace luxfield::cli

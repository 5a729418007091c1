// A light field as one picture and a page of JSON (docs/bridges.md): what our add-ons for Blender and
// Mitsuba read.
//
// Pixel (column W + i, row H + j) of the picture is C_ij of the texel (column, row), for those rows and
// columns that hold light: a texel's coefficients lie side by side, so that a program that
// interpolates between pixels interpolates between basis functions.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "luxfield/lightfield/posed_light_field.h"

namespace luxfield::bridges {

// Writes NAME.json and beside it NAME.json.exr, three channels R G B of float32 (of one channel three
// times the same); of several fields NAME.json.0.exr and so on. Returns the files, the JSON first. Holds
// one picture beside the fields. Throws InputError naming `source` where a field has no light, or a
// picture more than 2^15 pixels along a side, and naming a file that is in the way (core::RequireOwn).
std::vector<std::filesystem::path> WriteLampAtlas(
    const std::filesystem::path& json, std::span<const lightfield::PosedLightField> fields,
    const std::string& source);

// Writes NAME.xml, a part of a scene for Mitsuba 3 to include, and the atlas NAME.xml.json and its
// pictures beside it. Returns the files, the XML first. Throws InputError as WriteLampAtlas.
std::vector<std::filesystem::path> WriteMitsubaLamp(
    const std::filesystem::path& xml, std::span<const lightfield::PosedLightField> fields,
    const std::string& source);

}  // namespace luxfield::bridges

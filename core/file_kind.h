// What a file is, by its content.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace luxfield::core {

enum class FileKind {
  kUnknown,  // of no kind below, absent, unreadable or damaged: its reader says
  kFolder,   // that holds none of the following
  kSession,  // whose plan cannot be read
  kLightFieldSession,
  kSensorSession,
  kGeometrySession,
  kGlareSession,
  kFilterSession,
  kEnvironmentFrames,  // a folder of .exr or .hdr
  kPlan,
  kLab,
  kScene,
  kMotionPath,  // of a camera and of lamps: docs/formats/path.md
  kMeasurements,
  kLightField,
  kTables,
  kMeasuredFilter,
  kFlatField,
  kExrPicture,  // any other OpenEXR file
  kSensorCalibration,
  kGeometryCalibration,
  kGlareCalibration,
  kResponseCalibration,
  kFilterSheet,
  kFigures,      // what --json writes
  kRays,         // TM-25, Zemax, LightTools, Speos
  kIntensity,    // LM-63, EULUMDAT, TM-33, GLDF: a far field
  kForeignRays,  // ASAP, LucidShape
  kRadianceHdr,
  kPhotograph,  // PNG, JPEG, TIFF
  kMesh,
  kHtml
};

// By the first 256 KiB of a file: magic numbers, attributes, table names; formats that have none of
// these by their extension. Never throws.
FileKind WhatIs(const std::filesystem::path& path);

// "a light field (.lf.exr)"; "no file that luxfield knows" of kUnknown.
std::string NameOf(FileKind kind);

bool IsSession(FileKind kind);

}  // namespace luxfield::core

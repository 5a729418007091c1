// Pictures of a lamp's luminance as eyes see it, in false colours, with the fields of view in which it is
// brightest (docs/photometry.md).
#pragma once

#include <optional>
#include <string>

#include "luxfield/cli/reports/photometry_names.h"
#include "luxfield/formats/lamp_view.h"
#include "luxfield/photometry/answers.h"

namespace luxfield::cli {

// The picture that an eye asks for: in perspective all of the lamp, or, where it spans more than 150
// degrees, as a fisheye lens shows it; absent where none is asked for, or the eye is before no filter
// plane and sees no light.
std::optional<formats::Eye> PictureAsked(const photometry::Lamp& lamp,
                                         const photometry::EyeAsked& asked);

// What the picture shows beside the lamp; empty where there is no light.
std::string EyePictureNote(const photometry::EyeAnswer& answer, const PhotometryNames& names);
// How `luxfield export` writes it; `file` is the light field's.
std::string ExportNoteOf(const formats::Eye& eye, const std::string& file);

// An <svg> element. In perspective its axes are metres across the view at the lamp's distance, of a
// fisheye picture degrees from its middle.
std::string SvgEyePicture(const photometry::Lamp& lamp, const photometry::EyeAnswer& answer,
                          const formats::Eye& eye, const PhotometryNames& names);

}  // namespace luxfield::cli

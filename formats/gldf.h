// GLDF containers, Global Lighting Data Format 1.0 (docs/formats/photometric-files.md): a ZIP archive
// of product.xml and the files that it names.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "luxfield/formats/l3d.h"
#include "luxfield/formats/photometric.h"

namespace luxfield::formats {

// The far field of the first photometry that lies in the container, EULUMDAT, LM-63 or TM-33; what
// else it holds is not read. `file` is for messages. Throws InputError naming file, member and line.
Photometry ParseGldf(std::string_view bytes, const std::string& file);

// The first L3D that the container's geometries name and that lies in it; none without one.
std::optional<LampShape> ParseGldfShape(std::string_view bytes, const std::string& file);

// A container of one variant of one product with one emitter, its photometry as EULUMDAT, its
// luminous opening about `middle_m` of the luminaire's frame as L3D where that can say it
// (FormatL3d). The product's name is the keyword LUMINAIRE, its maker MANUFAC; its identifiers are
// those of the photometry's SHA-256, its time 0001-01-01T00:00:00Z. Throws InputError naming `file`
// for what EULUMDAT cannot hold.
std::string FormatGldf(const Photometry& photometry, lightfield::Vec3 middle_m,
                       const std::string& creator, const std::string& file);

}  // namespace luxfield::formats

// Fuzz targets: text that claims to be LM-63, EULUMDAT or TM-33, containers, and what lies in them. It ends in an
// InputError or in a table with a flux, which is written and read back. Archives have checksums, which no random change
// keeps: what lies in them is spoilt before they are made.
#pragma once

#include <cmath>
#include <cstdlib>
#include <string_view>

#include "luxfield/core/error.h"
#include "luxfield/formats/eulumdat.h"
#include "luxfield/formats/gldf.h"
#include "luxfield/formats/l3d.h"
#include "luxfield/formats/lm63.h"
#include "luxfield/formats/obj_faces.h"
#include "luxfield/formats/tm33.h"
#include "luxfield/formats/xml.h"
#include "luxfield/formats/zip.h"

namespace luxfield::fuzz {

inline void RequirePhotometry(const formats::Photometry& p) {
  formats::Validate(p, "input");
  if (!std::isfinite(formats::Flux(p)) || !std::isfinite(formats::Intensity(p, {0.3, -0.2, 0.9})))
    std::abort();
  formats::FindSymmetry(p);
}

inline void Lm63File(std::string_view input) {
  try {
    const formats::Photometry p = formats::ParseLm63(input, "input");
    RequirePhotometry(p);
    RequirePhotometry(
        formats::ParseLm63(formats::FormatLm63(p, formats::Lm63Version::k2019, "output"), "again"));
  } catch (const InputError&) {
  }
}

inline void EulumdatFile(std::string_view input) {
  try {
    const formats::Photometry p = formats::ParseEulumdat(input, "input");
    RequirePhotometry(p);
    RequirePhotometry(formats::ParseEulumdat(formats::FormatEulumdat(p, "output"), "again"));
  } catch (const InputError&) {
  }
}

inline void Tm33File(std::string_view input) {
  try {
    const formats::Photometry p = formats::ParseTm33(input, "input");
    RequirePhotometry(p);
    RequirePhotometry(formats::ParseTm33(formats::FormatTm33(p, "output"), "again"));
  } catch (const InputError&) {
  }
}

inline void GldfFile(std::string_view input) {
  try {
    RequirePhotometry(formats::ParseGldf(input, "input"));
  } catch (const InputError&) {
  }
}

// product.xml of a container that holds a.ldt and a.l3d.
inline void GldfProduct(std::string_view input) {
  static const std::string l3d =
      formats::FormatL3d({formats::Opening::Shape::kBox, 1, 1, 0}, {}, "fuzz").value();
  const std::string bytes = formats::FormatZip(
      {{"product.xml", std::string(input)},
       {"ldc/a.ldt",
        "c\n1\n1\n1\n0\n2\n90\n\n\n\n\n\n9\n0\n9\n9\n0\n0\n0\n0\n0\n100\n100\n1\n0\n1\n"
        "1\nLED\n1000\n\n\n9\n0\n0\n0\n0\n0\n0\n0\n0\n0\n0\n0\n0\n90\n200\n100\n"},
       {"geo/a.l3d", l3d}});
  try {
    RequirePhotometry(formats::ParseGldf(bytes, "input"));
    formats::ParseGldfShape(bytes, "input");
  } catch (const InputError&) {
  }
}

inline bool IsUnit(lightfield::Vec3 v) { return std::abs(lightfield::Length(v) - 1) < 1e-6; }

// structure.xml of a file with one mesh.
inline void L3dStructure(std::string_view input) {
  try {
    const formats::LampShape shape = formats::ParseL3d(
        formats::FormatZip({{"structure.xml", std::string(input)},
                            {"m/m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\ng b\nf 1 3 2\n"}}),
        "input");
    for (const auto& object : shape.objects)
      if (!std::isfinite(lightfield::Length(object.centre_m)) || !IsUnit(object.x_axis) ||
          !IsUnit(object.direction) || !(object.x_m > 0))
        std::abort();
    for (const auto& surface : shape.surfaces)
      if (!std::isfinite(surface.area_m2) || lightfield::Length(surface.direction) > 1 + 1e-6)
        std::abort();
  } catch (const InputError&) {
  }
}

inline void ObjMesh(std::string_view input) {
  try {
    for (const auto& group : formats::ParseObjFaces(input, "input"))
      if (group.faces() == 0 || !(group.area_up_to.back() >= 0)) std::abort();
  } catch (const InputError&) {
  }
}

// What is read, written again as far as elements and text go, is read as the same.
inline void XmlDocument(std::string_view input) {
  try {
    const formats::XmlElement root = formats::ParseXml(input, "input");
    if (root.name.empty()) std::abort();
    const std::string text = "<a>" + formats::XmlEscaped(root.text) + "</a>";
    if (formats::ParseXml(text, "again").name != "a") std::abort();
  } catch (const InputError&) {
  }
}

inline void ZipArchive(std::string_view input) {
  try {
    const formats::ZipReader reader(input, "input");
    for (const char* name : {"a", "b/c", "product.xml"})
      if (reader.Has(name) && reader.Read(name).size() > (std::size_t{1} << 26)) std::abort();
  } catch (const InputError&) {
  }
}

}  // namespace luxfield::fuzz

#include "luxfield/capture/filter/print_filter.h"

#include <cairo-pdf.h>
#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/outputs.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/spare_memory.h"
#include "luxfield/version.h"

namespace luxfield::capture {
namespace {

using lightfield::FilterKind;
using lightfield::Vec2;
using rig::FilterSheet;

constexpr double kMetresPerInch = 0.0254, kPointsPerInch = 72;
constexpr int kPointsPerAxis = 4;
constexpr double kMostPixels = 4e8;

struct CairoDelete {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};
using Surface = std::unique_ptr<cairo_surface_t, CairoDelete>;
using Context = std::unique_ptr<cairo_t, CairoDelete>;

void Check(cairo_status_t status, const std::filesystem::path& path) {
  if (status != CAIRO_STATUS_SUCCESS)
    throw DeviceError(fmt::format("{}: cannot be drawn ({}); free disk or memory", path.string(),
                                  cairo_status_to_string(status)));
}

std::string PrintName(const FilterSheet& sheet, int print) {
  if (sheet.filter == FilterKind::kBasis) return "";
  return print == 0 ? "plus" : "minus";
}

// The two lines above the filter.
std::vector<std::string> Header(const FilterSheet& sheet, int print, const PrintOptions& options) {
  std::string basis = sheet.basis.name();
  if (sheet.basis.a != 0) basis += fmt::format(" a={:.6g}", sheet.basis.a);
  const std::string kind = sheet.filter == FilterKind::kDual
                               ? fmt::format("dual, {} part", PrintName(sheet, print))
                               : fmt::format("scale {:.6g}", sheet.filter_scale);
  return {
      fmt::format("luxfield filter {}, {}, spacing {:.6g} mm", basis, kind, 1e3 * sheet.spacing_m),
      fmt::format("support {:.6g} mm, {:.6g} dpi, tone {}, this side up, u to the right",
                  1e3 * sheet.spacing_m * sheet.basis.cells, options.dpi,
                  options.tone.code.empty() ? "identity" : "by table")};
}

// Clear text in the strip above the filter; the unit is the sheet's metre, y downwards from its top
// edge.
void DrawHeader(cairo_t* context, const FilterSheet& sheet, int print,
                const PrintOptions& options) {
  const double support = sheet.basis.cells * sheet.spacing_m;
  const double left = sheet.half_m - 0.42 * support;
  core::RequireSpareMemory(core::kTextDrawingBytes);
  cairo_select_font_face(context, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(context, 0.026 * support);
  double y = sheet.half_m - 0.59 * support;
  for (const std::string& line : Header(sheet, print, options)) {
    cairo_move_to(context, left, y);
    cairo_show_text(context, line.c_str());
    y += 0.04 * support;
  }
}

// Its coverage per pixel.
std::vector<std::uint8_t> RasteriseHeader(const FilterSheet& sheet, int print,
                                          const PrintOptions& options, int width, int height) {
  const Surface surface(cairo_image_surface_create(CAIRO_FORMAT_A8, width, height));
  Check(cairo_surface_status(surface.get()), "header");
  {
    const Context context(cairo_create(surface.get()));
    const double pixels_per_m = options.dpi / kMetresPerInch;
    cairo_translate(context.get(), 0.5 * width - sheet.half_m * pixels_per_m,
                    0.5 * height - sheet.half_m * pixels_per_m);
    cairo_scale(context.get(), pixels_per_m, pixels_per_m);
    DrawHeader(context.get(), sheet, print, options);
    Check(cairo_status(context.get()), "header");
  }
  cairo_surface_flush(surface.get());
  const unsigned char* data = cairo_image_surface_get_data(surface.get());
  const int stride = cairo_image_surface_get_stride(surface.get());
  std::vector<std::uint8_t> coverage(static_cast<std::size_t>(width) * height);
  for (int row = 0; row < height; ++row)
    std::copy_n(data + static_cast<std::size_t>(row) * stride, width,
                coverage.begin() + static_cast<std::ptrdiff_t>(row) * width);
  return coverage;
}

void WriteTiff(const std::filesystem::path& path, const PrintedSheet& printed,
               const FilterSheet& sheet, int print, const PrintOptions& options) {
  const std::string name = PrintName(sheet, print);
  const std::string description =
      fmt::format("{{\"dpi\":{},\"print\":\"{}\",\"clear_density\":{},\"sheet\":{}}}", options.dpi,
                  name, options.tone.clear_density(), rig::SheetText(sheet));
  core::WriteAtomically(path, [&](const std::filesystem::path& temporary) {
    const std::unique_ptr<TIFF, decltype(&TIFFClose)> tiff(TIFFOpen(temporary.c_str(), "wl"),
                                                           &TIFFClose);
    bool ok = tiff != nullptr;
    const auto set = [&](auto tag, auto value) { ok = ok && TIFFSetField(tiff.get(), tag, value); };
    set(TIFFTAG_IMAGEWIDTH, printed.width);
    set(TIFFTAG_IMAGELENGTH, printed.height);
    set(TIFFTAG_SAMPLESPERPIXEL, 1);
    set(TIFFTAG_BITSPERSAMPLE, 16);
    set(TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    set(TIFFTAG_COMPRESSION, COMPRESSION_LZW);
    set(TIFFTAG_PREDICTOR, PREDICTOR_HORIZONTAL);
    set(TIFFTAG_ROWSPERSTRIP, 64);
    set(TIFFTAG_RESOLUTIONUNIT, RESUNIT_INCH);
    set(TIFFTAG_XRESOLUTION, options.dpi);
    set(TIFFTAG_YRESOLUTION, options.dpi);
    set(TIFFTAG_SOFTWARE, "luxfield " LUXFIELD_VERSION);
    set(TIFFTAG_IMAGEDESCRIPTION, description.c_str());
    std::vector<std::uint16_t> line(printed.width);  // libtiff's predictor writes into it
    for (int row = 0; ok && row < printed.height; ++row) {
      std::copy_n(printed.code.begin() + static_cast<std::ptrdiff_t>(row) * printed.width,
                  printed.width, line.begin());
      ok = TIFFWriteScanline(tiff.get(), line.data(), static_cast<std::uint32_t>(row), 0) == 1;
    }
    if (!ok || !TIFFFlush(tiff.get()))
      throw DeviceError(
          fmt::format("{}: cannot be written; free disk or choose another folder", path.string()));
  });
}

// 16 to 8 bits; the error of a pixel goes to its neighbours (Floyd and Steinberg 1976).
Surface Diffuse(const PrintedSheet& printed, const std::filesystem::path& path) {
  Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, printed.width, printed.height));
  Check(cairo_surface_status(surface.get()), path);
  unsigned char* data = cairo_image_surface_get_data(surface.get());
  const int stride = cairo_image_surface_get_stride(surface.get());
  const auto width = static_cast<std::size_t>(printed.width);
  std::vector<float> now(width + 2), next(width + 2);
  for (int row = 0; row < printed.height; ++row) {
    auto* pixels = reinterpret_cast<std::uint32_t*>(data + static_cast<std::size_t>(row) * stride);
    for (std::size_t column = 0; column < width; ++column) {
      const float wanted =
          static_cast<float>(printed.code[row * width + column]) / 257.0f + now[column + 1];
      const float value = std::clamp(std::round(wanted), 0.0f, 255.0f);
      const float error = wanted - value;
      now[column + 2] += error * (7.0f / 16);
      next[column] += error * (3.0f / 16);
      next[column + 1] += error * (5.0f / 16);
      next[column + 2] += error * (1.0f / 16);
      const auto grey = static_cast<std::uint32_t>(value);
      pixels[column] = grey << 16 | grey << 8 | grey;
    }
    now.swap(next);
    std::fill(next.begin(), next.end(), 0.0f);
  }
  cairo_surface_mark_dirty(surface.get());
  return surface;
}

// Cairo's own files are closed without a word where the last bytes do not fit on the disk.
cairo_status_t Append(void* bytes, const unsigned char* data, unsigned int count) noexcept {
  try {
    static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), count);
    return CAIRO_STATUS_SUCCESS;
  } catch (const std::exception&) {
    return CAIRO_STATUS_NO_MEMORY;
  }
}

void WritePdf(const std::filesystem::path& path, const std::vector<PrintedSheet>& prints,
              const FilterSheet& sheet, const PrintOptions& options) {
  std::string bytes;
  {
    const double points_per_pixel = kPointsPerInch / options.dpi;
    const Surface pdf(cairo_pdf_surface_create_for_stream(
        &Append, &bytes, prints.front().width * points_per_pixel,
        prints.front().height * points_per_pixel));
    Check(cairo_surface_status(pdf.get()), path);
    const std::string title = Header(sheet, 0, options).front();
    cairo_pdf_surface_set_metadata(pdf.get(), CAIRO_PDF_METADATA_TITLE, title.c_str());
    cairo_pdf_surface_set_metadata(pdf.get(), CAIRO_PDF_METADATA_SUBJECT,
                                   rig::SheetText(sheet).c_str());
    cairo_pdf_surface_set_metadata(pdf.get(), CAIRO_PDF_METADATA_CREATOR,
                                   "luxfield " LUXFIELD_VERSION);
    // No clock time: equal inputs give equal bytes.
    cairo_pdf_surface_set_metadata(pdf.get(), CAIRO_PDF_METADATA_CREATE_DATE, "");
    {
      const Context context(cairo_create(pdf.get()));
      for (const PrintedSheet& printed : prints) {
        const Surface image = Diffuse(printed, path);
        cairo_save(context.get());
        cairo_scale(context.get(), points_per_pixel, points_per_pixel);
        cairo_set_source_surface(context.get(), image.get(), 0, 0);
        cairo_pattern_set_filter(cairo_get_source(context.get()), CAIRO_FILTER_NEAREST);
        cairo_paint(context.get());
        cairo_restore(context.get());
        cairo_show_page(context.get());
      }
      Check(cairo_status(context.get()), path);
    }
    cairo_surface_finish(pdf.get());
    Check(cairo_surface_status(pdf.get()), path);
  }
  core::WriteFileAtomically(path, bytes);
}

}  // namespace

PrintedSheet RasteriseSheet(const FilterSheet& sheet, int print, const PrintOptions& options) {
  if (!(options.dpi >= 50 && options.dpi <= 20000))
    throw InputError(fmt::format("--dpi = {} must be between 50 and 20000", options.dpi));
  const double pixel_m = kMetresPerInch / options.dpi;
  const double size = std::round(2 * sheet.half_m / pixel_m);
  if (!(size >= 1 && size * size <= kMostPixels))
    throw InputError(fmt::format(
        "a sheet of {:.4g} mm at {} dpi has {:.3g} pixels a side, too many; lower --dpi",
        2e3 * sheet.half_m, options.dpi, size));
  PrintedSheet printed;
  printed.width = printed.height = static_cast<int>(size);
  printed.code.resize(static_cast<std::size_t>(printed.width) * printed.height);
  const auto text = RasteriseHeader(sheet, print, options, printed.width, printed.height);
  // Where the filter is, a pixel's mean transmittance is what its code has to print.
  core::ParallelFor(printed.height, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row)
      for (int column = 0; column < printed.width; ++column) {
        const auto at = [&](double across, double down) {
          return Vec2{(column + across - 0.5 * printed.width) * pixel_m,
                      (0.5 * printed.height - static_cast<double>(row) - down) * pixel_m};
        };
        double sum = 0;
        for (int k = 0; k < kPointsPerAxis * kPointsPerAxis; ++k)
          sum += sheet.Transmittance(at((k % kPointsPerAxis + 0.5) / kPointsPerAxis,
                                        (k / kPointsPerAxis + 0.5) / kPointsPerAxis),
                                     print);
        sum /= kPointsPerAxis * kPointsPerAxis;
        const std::size_t pixel = row * printed.width + column;
        const auto* step = sheet.StepAt(at(0.5, 0.5));
        const double code =
            step ? step->code : std::max(options.tone.Code(sum), text[pixel] / 255.0);
        printed.code[pixel] = static_cast<std::uint16_t>(std::lround(65535 * code));
      }
  });
  return printed;
}

std::vector<std::filesystem::path> PrintFilter(const FilterSheet& sheet,
                                               const std::filesystem::path& name,
                                               const PrintOptions& options) {
  std::vector<std::string> endings{".sheet.json"};
  for (int print = 0; print < sheet.prints(); ++print) {
    const std::string part = PrintName(sheet, print);
    endings.push_back(part.empty() ? ".tif" : "." + part + ".tif");
  }
  endings.emplace_back(".pdf");
  std::vector<std::filesystem::path> files;
  for (const std::string& ending : endings) {
    files.emplace_back(name.string() + ending);
    core::RequireOwn(files.back(), name, rig::kFilterSheetFormat);
  }
  std::vector<PrintedSheet> prints;
  for (int print = 0; print < sheet.prints(); ++print)
    prints.push_back(RasteriseSheet(sheet, print, options));
  rig::WriteFilterSheet(files.front(), sheet);
  for (int print = 0; print < sheet.prints(); ++print)
    WriteTiff(files[print + 1], prints[print], sheet, print, options);
  WritePdf(files.back(), prints, sheet, options);
  return files;
}

}  // namespace luxfield::capture

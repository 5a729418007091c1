#include "luxfield/bench/verbs/pictures_report.h"

#include <fmt/format.h>

#include "luxfield/cli/reports/html_page.h"
#include "luxfield/core/file.h"
#include "luxfield/core/measures.h"
#include "luxfield/render/film/film.h"

namespace luxfield::bench {
namespace {

std::string Figures(const FastPicture& picture) {
  const core::Difference& difference = picture.difference;
  return fmt::format(
      "relative RMSE {:.3g} %, by noise alone {:.3g} %; bias {:+.2g} %; mean Lab {:.3g}",
      100 * difference.rel_rmse, 100 * picture.noise, 100 * difference.bias, difference.mean_lab);
}

}  // namespace

std::filesystem::path WriteFastPictures(const std::vector<FastPicture>& pictures,
                                        const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  cli::HtmlPage page("Fast pictures beside their references");
  page.Paragraph(
      "Left a fast way, in the middle the slow one that it stands for at the same exposure, on the "
      "right the CIE 1976 difference of each pixel.");
  for (const FastPicture& picture : pictures) {
    const core::Image luminance = core::LuminanceImage(picture.reference.radiance);
    double sum = 0;
    for (const float value : luminance.data) sum += value;
    render::ToneMapping tone;
    tone.exposure = sum > 0 ? 0.35 * static_cast<double>(luminance.data.size()) / sum : 1;
    const auto file = [&](const char* what) { return picture.name + "-" + what + ".png"; };
    render::WritePng(folder / file("fast"), render::ToneMap(picture.fast.radiance, tone));
    render::WritePng(folder / file("reference"), render::ToneMap(picture.reference.radiance, tone));
    render::WriteFalseColour(folder / file("difference"),
                             core::LabDifference(picture.fast.radiance, picture.reference.radiance),
                             "CIE 1976", "Lab", {0.02, 20});
    page.Heading(picture.name);
    page.Paragraph(Figures(picture));
    page.Pictures({{file("fast"), picture.how},
                   {file("reference"), picture.reference_how},
                   {file("difference"), "difference"}});
  }
  std::filesystem::path path = folder / "index.html";
  core::WriteFileAtomically(path, page.Text());
  return path;
}

}  // namespace luxfield::bench

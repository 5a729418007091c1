#include "luxfield/cli/pdf/pdf_document.h"

#include <cairo-pdf.h>
#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <sstream>
#include <utility>

#include "luxfield/cli/pdf/svg_on_cairo.h"
#include "luxfield/cli/table_columns.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/spare_memory.h"

namespace luxfield::cli {
namespace {

// Points; A4.
constexpr double kWidth = 595.276, kHeight = 841.89, kLeft = 56, kRight = 50, kTop = 50,
                 kBottom = 60;
constexpr double kInner = kWidth - kLeft - kRight;
constexpr double kText = 9, kSmall = 7.5, kHeading = 11, kLine = 1.35;
constexpr std::size_t kTogether = 5;  // lines of a paragraph that stay on one page
constexpr double kCell = 8, kCellLine = 1.25, kCellPad = 3;  // of a table

struct CairoDelete {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};

class CairoPages : public PdfPages {
 public:
  // pages: 0 while they are counted.
  CairoPages(cairo_surface_t* surface, const PdfFacts& facts, int pages)
      : context_(cairo_create(surface)), facts_(facts), pages_(pages) {}

  void Title(const std::string& text) override { Lines(text, 15, true, 4); }
  void Heading(const std::string& text) override { heading_ = text; }
  void Paragraph(const std::string& text) override {
    Begin(kText * kLine * double(kTogether));
    Lines(text, kText, false, 4);
  }

  void Table(const std::vector<std::vector<std::string>>& rows) override {
    if (rows.empty()) return;
    Begin(4 * kCell * kCellLine);
    const std::vector<bool> numbers = NumberColumns(rows);
    const std::vector<double> widths = Widths(rows, numbers.size());
    for (std::size_t r = 0; r < rows.size(); ++r) {
      if (Row(numbers, widths, rows[r], r == 0)) continue;
      NewPage();
      if (r > 0) Row(numbers, widths, rows[0], true);
      Row(numbers, widths, rows[r], r == 0);
    }
    y_ += 8;
  }

  // Pages are counted by the plots' sizes alone.
  void Plots(const std::vector<std::string>& svgs, double most_height) override {
    constexpr double kGap = 8;
    double width = 0, height = 0;
    std::vector<SvgSize> sizes;
    for (const std::string& svg : svgs) {
      sizes.push_back(SizeOfSvg(svg));
      width += sizes.back().width;
      height = std::max(height, sizes.back().height);
    }
    if (svgs.empty() || !(width > 0)) return;
    const double gaps = kGap * double(svgs.size() - 1);
    const double scale = std::min((kInner - gaps) / width, most_height / height);
    Begin(scale * height);
    Need(scale * height);
    double x = kLeft;
    for (std::size_t k = 0; k < svgs.size(); ++k) {
      if (pages_ > 0) DrawSvg(context_.get(), svgs[k], x, y_, scale);
      x += scale * sizes[k].width + kGap;
    }
    y_ += scale * height + 6;
  }

  // Ends the last page; how many there are.
  int Finish() {
    Begin(0);
    Footer();
    cairo_show_page(context_.get());
    return page_;
  }
  cairo_status_t status() const { return cairo_status(context_.get()); }

 private:
  void Font(double size, bool bold) {
    cairo_select_font_face(context_.get(), "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL,
                           bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(context_.get(), size);
    cairo_set_source_rgb(context_.get(), 0, 0, 0);
  }
  double Advance(const std::string& text) {
    cairo_text_extents_t extents;
    cairo_text_extents(context_.get(), text.c_str(), &extents);
    return extents.x_advance;
  }
  void Show(double x, double y, const std::string& text) {
    cairo_move_to(context_.get(), x, y);
    cairo_show_text(context_.get(), text.c_str());
  }

  // What a line is broken between: words, and with them what alone says nothing: "(k = 1)", "3 %", "2° R".
  static std::vector<std::string> Words(const std::string& text) {
    std::vector<std::string> words;
    std::istringstream stream(text);
    for (std::string word; stream >> word;) {
      const std::size_t letters =
          static_cast<std::size_t>(std::count_if(word.begin(), word.end(), [](char c) {
            return (static_cast<unsigned char>(c) & 0xC0) != 0x80 && c != ',' && c != ';';
          }));
      if (!words.empty() && (letters <= 1 || words.back().ends_with(" =")))
        words.back() += " " + word;
      else
        words.push_back(word);
    }
    return words;
  }

  // Of the font that is set: between words, and within those that are too long.
  std::vector<std::string> Broken(const std::string& text, double width) {
    std::vector<std::string> lines(1);
    for (std::string word : Words(text)) {
      const std::string longer = lines.back().empty() ? word : lines.back() + " " + word;
      if (Advance(longer) <= width) {
        lines.back() = longer;
        continue;
      }
      if (!lines.back().empty()) lines.emplace_back();
      while (Advance(word) > width && word.size() > 1) {
        std::size_t keep = word.size() - 1;
        const auto is_middle = [&](std::size_t k) {
          return (static_cast<unsigned char>(word[k]) & 0xC0) == 0x80;  // of a character in UTF-8
        };
        while (keep > 1 && (is_middle(keep) || Advance(word.substr(0, keep)) > width)) --keep;
        lines.back() = word.substr(0, keep);
        word = word.substr(keep);
        lines.emplace_back();
      }
      lines.back() = word;
    }
    return lines;
  }

  // Of columns: as wide as their longest lines where the page holds them; else the widest are narrowed to
  // a common width, down to their longest words.
  std::vector<double> Widths(const std::vector<std::vector<std::string>>& rows,
                             std::size_t columns) {
    std::vector<double> line(columns, 2 * kCellPad), word(columns, 2 * kCellPad);
    for (std::size_t r = 0; r < rows.size(); ++r) {
      Font(kCell, r == 0);
      for (std::size_t k = 0; k < rows[r].size(); ++k) {
        line[k] = std::max(line[k], Advance(rows[r][k]) + 2 * kCellPad);
        for (const std::string& one : Words(rows[r][k]))
          word[k] = std::max(word[k], Advance(one) + 2 * kCellPad);
      }
    }
    const auto narrowed = [&](double most) {
      std::vector<double> widths(columns);
      for (std::size_t k = 0; k < columns; ++k)
        widths[k] = std::min(line[k], std::max(word[k], most));
      return widths;
    };
    const auto sum = [](const std::vector<double>& widths) {
      return std::accumulate(widths.begin(), widths.end(), 0.0);
    };
    constexpr int kHalvings = 40;
    double low = 0, high = 2 * kInner;
    for (int k = 0; k < kHalvings; ++k) {
      const double middle = (low + high) / 2;
      (sum(narrowed(middle)) <= kInner ? low : high) = middle;
    }
    std::vector<double> widths = narrowed(low);
    const double to_page = kInner / sum(widths);
    for (double& width : widths) width *= to_page;
    return widths;
  }

  // What is at least `height` high comes next, under the heading that waits for it.
  void Begin(double height) {
    constexpr double kBefore = 6, kAfter = 3;
    const std::string heading = std::exchange(heading_, {});
    if (heading.empty()) return;
    y_ += kBefore;
    Need(kHeading * kLine + kAfter + height);
    Lines(heading, kHeading, true, kAfter);
  }
  void Need(double height) {
    if (y_ + height > kHeight - kBottom) NewPage();
  }
  void NewPage() {
    Footer();
    cairo_show_page(context_.get());
    ++page_;
    y_ = kTop;
  }
  void Footer() {
    Font(kSmall, false);
    const double y = kHeight - kBottom + 24;
    cairo_set_line_width(context_.get(), 0.5);
    cairo_move_to(context_.get(), kLeft, y - 11);
    cairo_line_to(context_.get(), kWidth - kRight, y - 11);
    cairo_stroke(context_.get());
    const std::string number = fmt::format("page {} of {}", page_, pages_ > 0 ? pages_ : page_);
    Show(kWidth - kRight - Advance(number), y, number);
    const auto lines = Broken(facts_.footer, kInner - 70);
    for (std::size_t k = 0; k < lines.size(); ++k)
      Show(kLeft, y + double(k) * kSmall * kLine, lines[k]);
  }

  void Lines(const std::string& text, double size, bool bold, double after) {
    Font(size, bold);
    const std::vector<std::string> lines = Broken(text, kInner);
    if (lines.size() <= kTogether) Need(double(lines.size()) * size * kLine);
    for (const std::string& line : lines) {
      Need(size * kLine);
      Font(size, bold);
      y_ += size * kLine;
      Show(kLeft, y_ - 0.3 * size, line);
    }
    y_ += after;
  }

  // False: it does not fit on this page, and is not drawn.
  bool Row(const std::vector<bool>& numbers, const std::vector<double>& widths,
           const std::vector<std::string>& row, bool head) {
    Font(kCell, head);
    std::vector<std::vector<std::string>> cells;
    std::size_t lines = 1;
    for (std::size_t k = 0; k < widths.size(); ++k) {
      cells.push_back(Broken(k < row.size() ? row[k] : "", widths[k] - 2 * kCellPad));
      lines = std::max(lines, cells.back().size());
    }
    const double height = double(lines) * kCell * kCellLine + 3;
    if (y_ + height > kHeight - kBottom && y_ > kTop) return false;
    if (head) {
      cairo_set_source_rgb(context_.get(), 0.93, 0.93, 0.93);
      cairo_rectangle(context_.get(), kLeft, y_, kInner, height);
      cairo_fill(context_.get());
      cairo_set_source_rgb(context_.get(), 0, 0, 0);
    }
    double x = kLeft;
    for (std::size_t k = 0; k < widths.size(); ++k) {
      for (std::size_t line = 0; line < cells[k].size(); ++line) {
        const std::string& text = cells[k][line];
        Show(numbers[k] ? x + widths[k] - kCellPad - Advance(text) : x + kCellPad,
             y_ + double(line + 1) * kCell * kCellLine - 1, text);
      }
      x += widths[k];
    }
    y_ += height;
    cairo_set_source_rgb(context_.get(), 0.6, 0.6, 0.6);
    cairo_set_line_width(context_.get(), 0.4);
    cairo_move_to(context_.get(), kLeft, y_);
    cairo_line_to(context_.get(), kLeft + kInner, y_);
    cairo_stroke(context_.get());
    return true;
  }

  std::unique_ptr<cairo_t, CairoDelete> context_;
  const PdfFacts& facts_;
  std::string heading_;  // that waits for what follows
  int pages_, page_ = 1;
  double y_ = kTop;
};

// What is to be drawn, to be laid out more than once.
class RecordedPages : public PdfPages {
 public:
  void Title(const std::string& text) override {
    parts_.push_back([text](PdfPages& pages) { pages.Title(text); });
  }
  void Heading(const std::string& text) override {
    parts_.push_back([text](PdfPages& pages) { pages.Heading(text); });
  }
  void Paragraph(const std::string& text) override {
    parts_.push_back([text](PdfPages& pages) { pages.Paragraph(text); });
  }
  void Table(const std::vector<std::vector<std::string>>& rows) override {
    parts_.push_back([rows](PdfPages& pages) { pages.Table(rows); });
  }
  void Plots(const std::vector<std::string>& svgs, double most_height) override {
    parts_.push_back([svgs, most_height](PdfPages& pages) { pages.Plots(svgs, most_height); });
  }
  void DrawOn(PdfPages& pages) const {
    for (const auto& part : parts_) part(pages);
  }

 private:
  std::vector<std::function<void(PdfPages& pages)>> parts_;
};

// Draws to a file, or nowhere; the number of pages.
int DrawTo(const char* file, const std::filesystem::path& path, const PdfFacts& facts, int pages,
           const RecordedPages& recorded) {
  const std::unique_ptr<cairo_surface_t, CairoDelete> surface(
      cairo_pdf_surface_create(file, kWidth, kHeight));
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_TITLE, facts.title.c_str());
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATOR, "luxfield");
  int count = 0;
  cairo_status_t status = CAIRO_STATUS_SUCCESS;
  {
    CairoPages on(surface.get(), facts, pages);
    recorded.DrawOn(on);
    count = on.Finish();
    status = on.status();
  }
  cairo_surface_finish(surface.get());
  if (status == CAIRO_STATUS_SUCCESS) status = cairo_surface_status(surface.get());
  if (status != CAIRO_STATUS_SUCCESS)
    throw DeviceError(fmt::format("{}: cannot be drawn ({}); free disk or memory", path.string(),
                                  cairo_status_to_string(status)));
  return count;
}

}  // namespace

void WritePdf(const std::filesystem::path& path, const PdfFacts& facts,
              const std::function<void(PdfPages& pages)>& draw) {
  core::RequireSpareMemory(core::kTextDrawingBytes);
  RecordedPages recorded;
  draw(recorded);
  const int pages = DrawTo(nullptr, path, facts, 0, recorded);
  core::WriteAtomically(path, [&](const std::filesystem::path& temporary) {
    DrawTo(temporary.c_str(), path, facts, pages, recorded);
  });
}

}  // namespace luxfield::cli

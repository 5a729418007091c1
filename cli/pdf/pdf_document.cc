#include "luxfield/cli/pdf/pdf_document.h"

#include <cairo-pdf.h>
#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <sstream>
#include <string_view>
#include <utility>

#include "luxfield/cli/pdf/svg_on_cairo.h"
#include "luxfield/cli/table_columns.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/printable.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/spare_memory.h"

namespace luxfield::cli {
namespace {

// Points; A4.
constexpr double kWidth = 595.276, kHeight = 841.89, kLeft = 56, kRight = 50, kTop = 50,
                 kBottom = 60;
constexpr double kInner = kWidth - kLeft - kRight;
constexpr double kText = 9, kSmall = 7.5, kHeading = 11, kLine = 1.35;
constexpr std::size_t kTogether = 5;  // lines of a paragraph that stay on one page
constexpr double kCell = 8, kCellPitch = 1.25 * kCell, kCellPad = 3, kRowGap = 3;  // of a table
constexpr std::size_t kWhole = 15;       // lines of a row that stay on one page
constexpr std::size_t kFooterLines = 3;  // that lie on the page

struct CairoDelete {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};

class CairoPages : public PdfPages {
 public:
  // pages: 0 while they are counted.
  CairoPages(cairo_surface_t* surface, const std::string& footer, int pages)
      : context_(cairo_create(surface)), pages_(pages) {
    Font(kSmall, false);
    footer_ = Broken(footer, kInner - 70);
    if (footer_.size() <= kFooterLines) return;
    footer_.resize(kFooterLines);
    footer_.back() += " ...";
  }

  void Title(const std::string& text) override { Lines(text, 15, true, 4); }
  void Heading(const std::string& text) override { heading_ = text; }
  void Paragraph(const std::string& text) override {
    Begin(kText * kLine * double(kTogether));
    Lines(text, kText, false, 4);
  }

  void Table(const std::vector<std::vector<std::string>>& rows) override {
    if (rows.empty()) return;
    const Columns columns = ColumnsOf(rows);
    const Row head = Broken(columns, rows[0], true);
    double begins =
        LeastHeight(head);  // what stays together: the head and where the first row begins
    if (rows.size() > 1) begins += LeastHeight(Broken(columns, rows[1], false));
    Begin(begins);
    Need(begins);
    AddRow(columns, head, nullptr);
    for (std::size_t r = 1; r < rows.size(); ++r)
      AddRow(columns, Broken(columns, rows[r], false), &head);
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
      constexpr std::size_t kMostBytes = 40;
      if (!words.empty() && words.back().size() < kMostBytes &&
          (letters <= 1 || words.back().ends_with(" =")))
        words.back() += " " + word;
      else
        words.push_back(word);
    }
    return words;
  }

  // Of the font that is set: between words, and within those that are too long.
  std::vector<std::string> Broken(const std::string& text, double width) {
    std::vector<std::string> lines(1);
    for (const std::string& word : Words(text)) {
      const std::string longer = lines.back().empty() ? word : lines.back() + " " + word;
      if (Advance(longer) <= width) {
        lines.back() = longer;
        continue;
      }
      if (!lines.back().empty()) lines.emplace_back();
      AddInPieces(word, width, lines);
    }
    return lines;
  }

  // A word that is wider than a line. A mark has no width of its own and stays with its letter.
  void AddInPieces(std::string_view word, double width, std::vector<std::string>& lines) {
    double used = 0;
    while (!word.empty()) {
      const std::string letter(word.substr(0, core::FirstCharacter(word).bytes));
      const double advance = Advance(letter);
      if (used + advance > width && !lines.back().empty()) {
        lines.emplace_back();
        used = 0;
      }
      lines.back() += letter;
      used += advance;
      word.remove_prefix(letter.size());
    }
  }

  struct Columns {
    std::vector<bool> numbers;
    std::vector<double> widths;
  };
  // Lines of its cells.
  struct Row {
    std::vector<std::vector<std::string>> cells;
    std::size_t lines = 1;  // of the cell that has most
    bool head = false;
  };

  // As wide as their longest lines where the page holds them; else the widest are narrowed to a common
  // width, down to their longest words or, where the page does not hold these, to equal shares of it.
  Columns ColumnsOf(const std::vector<std::vector<std::string>>& rows) {
    Columns columns{NumberColumns(rows), {}};
    const std::size_t count = columns.numbers.size();
    std::vector<double> line(count, 2 * kCellPad), word = line;
    for (std::size_t r = 0; r < rows.size(); ++r) {
      Font(kCell, r == 0);
      for (std::size_t k = 0; k < rows[r].size(); ++k) {
        line[k] = std::max(line[k], Advance(rows[r][k]) + 2 * kCellPad);
        for (const std::string& one : Words(rows[r][k]))
          word[k] = std::max(word[k], Advance(one) + 2 * kCellPad);
      }
    }
    if (Sum(word) > kInner)
      for (double& width : word) width = std::min(width, kInner / double(count));
    columns.widths = Narrowed(line, word);
    const double to_page = kInner / Sum(columns.widths);
    for (double& width : columns.widths) width *= to_page;
    return columns;
  }

  static double Sum(const std::vector<double>& widths) {
    return std::accumulate(widths.begin(), widths.end(), 0.0);
  }
  // Those that are wider than a common width are of that width, but not below `least`.
  static std::vector<double> Narrowed(const std::vector<double>& widths,
                                      const std::vector<double>& least) {
    const auto narrowed = [&](double most) {
      std::vector<double> narrow(widths.size());
      for (std::size_t k = 0; k < narrow.size(); ++k)
        narrow[k] = std::min(widths[k], std::max(least[k], most));
      return narrow;
    };
    constexpr int kHalvings = 40;
    double low = 0, high = 2 * kInner;
    for (int k = 0; k < kHalvings; ++k) {
      const double middle = (low + high) / 2;
      (Sum(narrowed(middle)) <= kInner ? low : high) = middle;
    }
    return narrowed(low);
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
    core::ThrowIfInterrupted();
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
    for (std::size_t k = 0; k < footer_.size(); ++k)
      Show(kLeft, y + double(k) * kSmall * kLine, footer_[k]);
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

  Row Broken(const Columns& columns, const std::vector<std::string>& cells, bool head) {
    Font(kCell, head);
    Row row{{}, 1, head};
    for (std::size_t k = 0; k < columns.widths.size(); ++k) {
      row.cells.push_back(
          Broken(k < cells.size() ? cells[k] : "", columns.widths[k] - 2 * kCellPad));
      row.lines = std::max(row.lines, row.cells.back().size());
    }
    return row;
  }
  static double Height(std::size_t lines) { return double(lines) * kCellPitch + kRowGap; }
  // Of what stays together.
  static double LeastHeight(const Row& row) {
    return Height(row.lines <= kWhole ? row.lines : kTogether);
  }

  // Over as many pages as it takes, each but the first below the head, if there is one.
  void AddRow(const Columns& columns, const Row& row, const Row* head) {
    if (y_ + LeastHeight(row) > kHeight - kBottom) TurnPage(columns, head);
    for (std::size_t from = 0; from < row.lines;) {
      const auto fit =
          static_cast<std::size_t>((kHeight - kBottom - y_ - kRowGap) / kCellPitch + 1e-6);
      const std::size_t to = std::min(row.lines, from + std::max<std::size_t>(fit, 1));
      DrawLines(columns, row, from, to);
      from = to;
      if (from < row.lines) TurnPage(columns, head);
    }
  }
  void TurnPage(const Columns& columns, const Row* head) {
    NewPage();
    if (head && head->lines <= kWhole) DrawLines(columns, *head, 0, head->lines);
  }

  void DrawLines(const Columns& columns, const Row& row, std::size_t from, std::size_t to) {
    Font(kCell, row.head);
    const double height = Height(to - from);
    if (row.head) {
      cairo_set_source_rgb(context_.get(), 0.93, 0.93, 0.93);
      cairo_rectangle(context_.get(), kLeft, y_, kInner, height);
      cairo_fill(context_.get());
      cairo_set_source_rgb(context_.get(), 0, 0, 0);
    }
    double x = kLeft;
    for (std::size_t k = 0; k < columns.widths.size(); ++k) {
      for (std::size_t line = from; line < std::min(to, row.cells[k].size()); ++line) {
        const std::string& text = row.cells[k][line];
        Show(columns.numbers[k] ? x + columns.widths[k] - kCellPad - Advance(text) : x + kCellPad,
             y_ + double(line - from + 1) * kCellPitch - 1, text);
      }
      x += columns.widths[k];
    }
    // What goes on from the page before says so where its name stood.
    if (from > 0 && row.cells[0].size() <= from) {
      cairo_set_source_rgb(context_.get(), 0.4, 0.4, 0.4);
      Show(kLeft + kCellPad, y_ + kCellPitch - 1, "(continued)");
    }
    y_ += height;
    cairo_set_source_rgb(context_.get(), 0.6, 0.6, 0.6);
    cairo_set_line_width(context_.get(), 0.4);
    cairo_move_to(context_.get(), kLeft, y_);
    cairo_line_to(context_.get(), kLeft + kInner, y_);
    cairo_stroke(context_.get());
  }

  std::unique_ptr<cairo_t, CairoDelete> context_;
  std::vector<std::string> footer_;
  std::string heading_;  // that waits for what follows
  int pages_, page_ = 1;
  double y_ = kTop;
};

// What is to be drawn, to be laid out more than once, in characters that can be seen.
class RecordedPages : public PdfPages {
 public:
  void Title(const std::string& text) override {
    parts_.push_back([text = core::Visible(text)](PdfPages& pages) { pages.Title(text); });
  }
  void Heading(const std::string& text) override {
    parts_.push_back([text = core::Visible(text)](PdfPages& pages) { pages.Heading(text); });
  }
  void Paragraph(const std::string& text) override {
    parts_.push_back([text = core::Visible(text)](PdfPages& pages) { pages.Paragraph(text); });
  }
  void Table(const std::vector<std::vector<std::string>>& rows) override {
    std::vector<std::vector<std::string>> visible = rows;
    for (auto& row : visible)
      for (std::string& cell : row) cell = core::Visible(cell);
    parts_.push_back([rows = std::move(visible)](PdfPages& pages) { pages.Table(rows); });
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

// Cairo's own files are closed without a word where the last bytes do not fit on the disk.
cairo_status_t Append(void* bytes, const unsigned char* data, unsigned int count) noexcept {
  try {
    static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), count);
    return CAIRO_STATUS_SUCCESS;
  } catch (const std::exception&) {
    return CAIRO_STATUS_NO_MEMORY;
  }
}

// Draws into `bytes`, or nowhere; the number of pages.
int DrawTo(std::string* bytes, const std::filesystem::path& path, const PdfFacts& facts, int pages,
           const RecordedPages& recorded) {
  const std::unique_ptr<cairo_surface_t, CairoDelete> surface(
      cairo_pdf_surface_create_for_stream(bytes ? &Append : nullptr, bytes, kWidth, kHeight));
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_TITLE, facts.title.c_str());
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATOR, "luxfield");
  int count = 0;
  cairo_status_t status = CAIRO_STATUS_SUCCESS;
  {
    CairoPages on(surface.get(), facts.footer, pages);
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
  const PdfFacts visible{core::Visible(facts.title), core::Visible(facts.footer)};
  const int pages = DrawTo(nullptr, path, visible, 0, recorded);
  std::string bytes;
  DrawTo(&bytes, path, visible, pages, recorded);
  core::WriteFileAtomically(path, bytes);
}

}  // namespace luxfield::cli

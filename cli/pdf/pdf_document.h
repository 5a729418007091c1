// Documents on A4 by Cairo: headings, paragraphs, tables and the plots of cli/svg, one below the
// other, broken into numbered pages.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace luxfield::cli {

struct PdfColumn {
  double share = 1;    // of the width of the page, relative to the other columns
  bool right = false;  // aligned
};

class PdfPages {
 public:
  virtual ~PdfPages() = default;
  virtual void Title(const std::string& text) = 0;
  virtual void Heading(const std::string& text) = 0;
  virtual void Paragraph(const std::string& text) = 0;
  // The first row is the head, repeated where a page ends within the table. Text that is too wide for
  // its column is broken between words.
  virtual void Table(const std::vector<PdfColumn>& columns,
                     const std::vector<std::vector<std::string>>& rows) = 0;
  // Side by side, as large as they fit, at most `most_height` points high; on one page.
  virtual void Plots(const std::vector<std::string>& svgs, double most_height) = 0;
  virtual void PageBreak() = 0;
};

struct PdfFacts {
  std::string title;   // of the file
  std::string footer;  // on every page, left of "page 1 of 3"
};

// Calls draw twice: the first time counts the pages. The file is there whole or not at all.
void WritePdf(const std::filesystem::path& path, const PdfFacts& facts,
              const std::function<void(PdfPages& pages)>& draw);

}  // namespace luxfield::cli

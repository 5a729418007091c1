// Documents on A4 by Cairo: headings, paragraphs, tables and the plots of cli/svg, one below the
// other, broken into numbered pages.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace luxfield::cli {

class PdfPages {
 public:
  virtual ~PdfPages() = default;
  virtual void Title(const std::string& text) = 0;
  // It stands on the page on which what follows begins.
  virtual void Heading(const std::string& text) = 0;
  virtual void Paragraph(const std::string& text) = 0;
  // The first row is the head, repeated where a page ends within the table. Columns are as wide as
  // what they hold; where that is wider than the page, text is broken between words, and between the
  // characters of words that alone are too wide. Rows that are high go on on the next page. Columns of
  // numbers are right-aligned.
  virtual void Table(const std::vector<std::vector<std::string>>& rows) = 0;
  // Side by side, as large as they fit, at most `most_height` points high; on one page.
  virtual void Plots(const std::vector<std::string>& svgs, double most_height) = 0;
};

struct PdfFacts {
  std::string title;   // of the file
  std::string footer;  // on every page, left of "page 1 of 3"; at most three lines of it
};

// Calls draw once. The file is there whole or not at all. Texts are shown as core::Visible does.
void WritePdf(const std::filesystem::path& path, const PdfFacts& facts,
              const std::function<void(PdfPages& pages)>& draw);

}  // namespace luxfield::cli

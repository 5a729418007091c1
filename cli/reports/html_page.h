// Self-contained HTML reports: text, tables, plots, and pictures that lie beside the page.
#pragma once

#include <string>
#include <vector>

namespace luxfield::cli {

class HtmlPage {
 public:
  explicit HtmlPage(const std::string& title);
  void Heading(const std::string& text);
  void Paragraph(const std::string& text);
  // The first row is the header (left out if all empty); columns of numbers are right-aligned.
  void Table(const std::vector<std::vector<std::string>>& rows);
  // Side by side; files relative to the page.
  void Pictures(const std::vector<std::pair<std::string, std::string>>& files_and_captions);
  void Raw(const std::string& html);  // an SvgPlot
  std::string Text() const;

 private:
  std::string body_;
  std::string title_;
};

}  // namespace luxfield::cli

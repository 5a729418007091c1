#include "luxfield/cli/reports/html_page.h"

#include <fmt/format.h>

#include <algorithm>

#include "luxfield/cli/svg/svg_plot.h"
#include "luxfield/cli/table_columns.h"

namespace luxfield::cli {
HtmlPage::HtmlPage(const std::string& title) : title_(title) {
  body_ = fmt::format("<h1>{}</h1>\n", EscapeXml(title));
}

void HtmlPage::Heading(const std::string& text) {
  body_ += fmt::format("<h2>{}</h2>\n", EscapeXml(text));
}
void HtmlPage::Paragraph(const std::string& text) {
  body_ += fmt::format("<p>{}</p>\n", EscapeXml(text));
}
void HtmlPage::Raw(const std::string& html) { body_ += html; }

void HtmlPage::Table(const std::vector<std::vector<std::string>>& rows) {
  const std::vector<bool> numbers = NumberColumns(rows);
  body_ += "<table>\n";
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const auto& row = rows[r];
    if (std::all_of(row.begin(), row.end(), [](const std::string& cell) { return cell.empty(); }))
      continue;
    body_ += "<tr>";
    for (std::size_t k = 0; k < row.size(); ++k)
      body_ += fmt::format("<{0}{1}>{2}</{0}>", r == 0 ? "th" : "td",
                           numbers[k] ? " class=\"number\"" : "", EscapeXml(row[k]));
    body_ += "</tr>\n";
  }
  body_ += "</table>\n";
}

void HtmlPage::Pictures(
    const std::vector<std::pair<std::string, std::string>>& files_and_captions) {
  body_ += "<div class=\"row\">\n";
  for (const auto& [file, caption] : files_and_captions)
    body_ +=
        fmt::format("<figure><img src=\"{0}\" alt=\"{1}\"><figcaption>{1}</figcaption></figure>\n",
                    EscapeXml(file), EscapeXml(caption));
  body_ += "</div>\n";
}

std::string HtmlPage::Text() const {
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta "
      "charset=\"utf-8\"><title>{}</title>\n<style>\n"
      "body {{ font: 16px/1.5 sans-serif; max-width: 1080px; margin: 2em auto; padding: 0 1em; "
      "color: #222; background: #fff; }}\n"
      "h1 {{ font-size: 1.6em; }} h2 {{ font-size: 1.2em; margin-top: 2em; border-bottom: 1px "
      "solid #ccc; }}\n"
      "table {{ border-collapse: collapse; margin: 1em 0; }} th, td {{ padding: 0.25em 0.9em; "
      "border-bottom: 1px solid #ddd; }}\n"
      "th {{ text-align: left; background: #f4f4f4; }} .number {{ text-align: right; white-space: "
      "nowrap; }}\n"
      ".row {{ display: flex; flex-wrap: wrap; gap: 1em; }} figure {{ margin: 0; flex: 1 1 320px; "
      "}}\n"
      "p {{ overflow-wrap: anywhere; }} svg {{ max-width: 100%; height: auto; }} table {{ display: "
      "block; overflow-x: auto; }}\n"
      "figure img {{ max-width: 100%; height: auto; border: 1px solid #ccc; }} figcaption {{ "
      "font-size: 0.9em; color: #555; }}\n"
      "@media (max-width: 600px) {{ table {{ font-size: 0.8em; }} th, td {{ padding: 0.25em "
      "0.35em; }} td:not(.number) {{ min-width: 4.5em; }} }}\n"
      "</style></head>\n<body>\n{}</body></html>\n",
      EscapeXml(title_), body_);
}

}  // namespace luxfield::cli

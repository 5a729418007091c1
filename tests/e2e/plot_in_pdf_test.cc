// Every plot that reports draw can be drawn on the pages of a certificate; pages are numbered.
#include <cairo-pdf.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <array>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <regex>
#include <sstream>
#include <vector>

#include "luxfield/cli/pdf/pdf_document.h"
#include "luxfield/cli/pdf/svg_on_cairo.h"
#include "luxfield/cli/svg/svg_bars.h"
#include "luxfield/cli/svg/svg_isolux.h"
#include "luxfield/cli/svg/svg_plot.h"
#include "luxfield/cli/svg/svg_polar.h"
#include "luxfield/cli/svg/svg_solid.h"
#include "luxfield/core/error.h"
#include "tests/e2e/pdf_text.h"

namespace luxfield::cli {
namespace {

IsoluxMap Map() {
  IsoluxMap map;
  map.title = "a & b <c>";
  map.unit = "lx";
  map.columns = map.rows = 20;
  for (int k = 0; k < 400; ++k) map.values.push_back(100.0 * std::sin(0.05 * k));
  map.marks = {{0.5, 0.5, "75R", false}, {0.2, 0.3, "B50L", true}, {9, 9, "outside", true}};
  map.lines = {{{{0.1, 0.1}, {0.9, 0.9}}, true}, {{{0.1, 0.9}, {2, 0.9}, {0.9, 0.1}}, false}};
  return map;
}

std::vector<std::string> Plots() {
  const std::vector<double> x = {-2, 0, 3}, y = {1, 4, 2};
  Plot plot;
  plot.title = "plot";
  plot.series = {{"a", x, y}, {"b", x, y, true, {}, false, true}, {"c", x, y, false, {}, true}};
  IntensitySolid solid{"solid", "cd", {0, 90, 180, 270}, {0, 30, 60, 90}, {}};
  for (int k = 0; k < 16; ++k) solid.value.push_back(100 - 20 * (k % 4));
  return {
      SvgPlot(plot),
      SvgPolar({"polar", "cd", {{"C0", {-90, 0, 90}, {0, 5, 1}}}}),
      SvgIsolux(Map()),
      SvgDifference(Map()),
      SvgSolid(solid),
      SvgBars("bars", {{"one", 1.0, "1 %"}, {"none", {}, "not stated"}, {"all", 2.0, "2 %", true}}),
      SvgPolar({"dark", "cd", {}}),
      SvgSolid({"dark", "cd", {0, 180}, {0, 90}, {0, 0, 0, 0}})};
}

// The share of a picture's pixels that is not white, drawn from `left` on.
double Ink(const std::string& svg, double left = 0) {
  const SvgSize size = SizeOfSvg(svg);
  const int width = static_cast<int>(size.width), height = static_cast<int>(size.height);
  cairo_surface_t* surface = cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height);
  cairo_t* context = cairo_create(surface);
  cairo_set_source_rgb(context, 1, 1, 1);
  cairo_paint(context);
  DrawSvg(context, svg, left, 0, 1);
  cairo_surface_flush(surface);
  const unsigned char* data = cairo_image_surface_get_data(surface);
  const int stride = cairo_image_surface_get_stride(surface);
  int inked = 0;
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column) {
      const unsigned char* pixel = data + row * stride + 4 * column;
      inked += pixel[0] + pixel[1] + pixel[2] < 3 * 250;
    }
  cairo_destroy(context);
  cairo_surface_destroy(surface);
  return double(inked) / width / height;
}

TEST(PlotsOnCairo, AreDrawnAllOfThem) {
  for (const std::string& svg : Plots()) {
    EXPECT_GT(Ink(svg), 0.001) << svg.substr(0, 200);
    EXPECT_LT(Ink(svg), 0.9) << svg.substr(0, 200);
  }
}

// Drawn left of the picture, none of the text that is longer than its plot is seen.
TEST(PlotsOnCairo, AreCutAtTheirEdges) {
  const std::string svg =
      "<svg width=\"60\" height=\"30\"><text x=\"1\" y=\"20\" font-size=\"20\">" +
      std::string(50, 'W') + "</text></svg>";
  EXPECT_GT(Ink(svg), 0.1);
  EXPECT_EQ(Ink(svg, -60), 0);
}

TEST(PlotsOnCairo, WhatIsNotKnownIsRefused) {
  const std::string head = "<svg width=\"9\" height=\"9\">";
  for (const char* wrong : {"<ellipse/>", "<path d=\"M1 2C3 4\"/>", "<rect fill=\"teal\"/>",
                            "<g transform=\"skewX(3)\"><line/></g>"})
    EXPECT_THROW(Ink(head + wrong + "</svg>"), std::logic_error) << wrong;
}

TEST(Pdf, PagesAreNumberedAndTablesBreak) {
  const auto file = std::filesystem::path(testing::TempDir()) / "pages.pdf";
  int drawn = 0;
  WritePdf(file, {"title", "footer"}, [&](PdfPages& pages) {
    ++drawn;
    pages.Title("A title");
    std::vector<std::vector<std::string>> rows{{"head", "value"}};
    for (int k = 0; k < 150; ++k)
      rows.push_back({"row that has a name which is far too long for its column", "1"});
    pages.Table(rows);
    pages.Plots(Plots(), 150);
  });
  EXPECT_EQ(drawn, 1);
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  EXPECT_THAT(text.str(), testing::StartsWith("%PDF-"));
  EXPECT_THAT(text.str(), testing::HasSubstr("/Count 3"));
  std::filesystem::remove(file);
}

// How many pages are drawn.
std::string CountOfPages(const std::function<void(PdfPages&)>& draw) {
  const auto file = std::filesystem::path(testing::TempDir()) / "count.pdf";
  WritePdf(file, {"title", "footer"}, draw);
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  std::filesystem::remove(file);
  std::smatch count;
  const std::string all = text.str();
  return std::regex_search(all, count, std::regex("/Count ([0-9]+)")) ? count[1].str() : "";
}

// A page has 732 points. The heading fits below the first plot, the plot that follows it does not; a page
// without the heading would hold the other two plots.
// To the last byte: what does not fit is no file.
TEST(Pdf, AFileThatTheDiskDoesNotTakeIsRefused) {
  const auto path = std::filesystem::path(testing::TempDir()) / "luxfield_no_room.pdf";
  const auto write = [&] {
    WritePdf(path, {"a", "b"}, [](PdfPages& pages) { pages.Paragraph("text"); });
  };
  write();
  const auto whole = std::filesystem::file_size(path);
  std::filesystem::remove(path);
  const auto handler = ::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  for (const std::uintmax_t missing : {1, 100, 1000}) {
    const rlimit less{whole - missing, before.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &less);
    EXPECT_THROW(write(), DeviceError) << missing;
    ::setrlimit(RLIMIT_FSIZE, &before);
    EXPECT_FALSE(std::filesystem::exists(path)) << missing;
  }
  ::signal(SIGXFSZ, handler);
}

TEST(Pdf, HeadingsStandAboveWhatFollows) {
  const std::string tall =
      "<svg width=\"100\" height=\"700\"><rect x=\"0\" y=\"0\" width=\"9\" "
      "height=\"9\" fill=\"#000\"/></svg>";
  EXPECT_EQ(CountOfPages([&](PdfPages& pages) {
              pages.Plots({tall}, 660);
              pages.Heading("Luminance");
              pages.Plots({tall}, 360);
              pages.Plots({tall}, 360);
            }),
            "3");
}

// 55 lines fit on a page.
TEST(Pdf, TablesKeepLinesThatFitWhole) {
  std::vector<std::vector<std::string>> rows{{"requirement", "probability"}};
  for (int k = 0; k < 40; ++k)
    rows.push_back(
        {"a name that is longer than half of the page is wide, by some words at least", "1"});
  EXPECT_EQ(CountOfPages([&](PdfPages& pages) { pages.Table(rows); }), "1");
}

constexpr char kFooter[] = "FOOTER";

// The letters of a document without what is of its pages: footers, heads of tables that are repeated,
// and the word that says so. None of it may hold the letters themselves.
std::string LettersDrawn(const std::function<void(PdfPages&)>& draw, const std::string& head = "") {
  const auto file = std::filesystem::path(testing::TempDir()) / "letters.pdf";
  WritePdf(file, {"title", kFooter}, draw);
  const std::string text = e2e::LettersOf(file);
  std::filesystem::remove(file);
  const std::string of_pages = std::string("page[0-9]+of[0-9]+") + kFooter + "|\\(continued\\)";
  return std::regex_replace(text, std::regex(head.empty() ? of_pages : of_pages + "|" + head), "");
}

// Numbers that tell every part of the text from every other: words of `letters`, ten bytes and more each.
std::string Numbered(std::size_t bytes, const char* between) {
  std::string text;
  for (int k = 0; text.size() < bytes; ++k) text += fmt::format("{:09}{}", k, between);
  return text;
}

std::string WithoutSpaces(std::string text) {
  std::erase(text, ' ');
  return text;
}

class PdfText : public testing::Test {
 protected:
  void SetUp() override {
    if (!e2e::HasPdfReader()) GTEST_SKIP() << "pdftotext (poppler-utils) is missing";
  }
};

// A page holds some 5400 letters of such a row.
TEST_F(PdfText, RowsOfTablesBreakOverPagesAndLoseNothing) {
  for (const std::size_t bytes : {5400u, 6000u, 100000u}) {
    const std::string text = Numbered(bytes, " ");
    EXPECT_EQ(LettersDrawn(
                  [&](PdfPages& pages) {
                    pages.Title("title");
                    pages.Table({{"HEAD", "VALUE"}, {"before", "1"}, {"of", text}, {"after", "2"}});
                  },
                  "HEADVALUE"),
              "titlebefore1of" + WithoutSpaces(text) + "after2")
        << bytes;
  }
}

TEST_F(PdfText, LongWordsAreBrokenWithinAndLoseNothing) {
  for (const std::size_t bytes : {350u, 10000u, 100000u}) {
    const std::string word = Numbered(bytes, "");
    EXPECT_EQ(LettersDrawn(
                  [&](PdfPages& pages) {
                    pages.Title(word);
                    pages.Table({{"HEAD", "VALUE"}, {"1", word}});
                    pages.Heading(word);
                    pages.Paragraph(word);
                  },
                  "HEADVALUE"),
              word + "1" + word + word + word)
        << bytes;
  }
}

// Beside a word that takes the page's width, and in heads, which are of several pages then.
TEST_F(PdfText, LongWordsLeaveOtherColumnsTheirWidth) {
  const std::string word = Numbered(10000, "");
  EXPECT_EQ(CountOfPages([&](PdfPages& pages) {
              std::vector<std::vector<std::string>> rows{{"quantity", word, "value", "unit"}};
              for (int k = 0; k < 10; ++k) rows.push_back({"largest intensity", "c", "1.5", "cd"});
              pages.Table(rows);
            }),
            CountOfPages([&](PdfPages& pages) {
              pages.Table({{"quantity", word, "value", "unit"}, {"", "", "1", ""}});
            }));
  EXPECT_EQ(LettersDrawn([&](PdfPages& pages) {
              pages.Table({{"HEAD", word, word}, {word, "b", word}, {"1", "2", "3"}});
            }).size(),
            4 * word.size() + 4 + 1 + 3);
}

// Two, three and four bytes a character, and marks on letters: no character is cut in half, and no
// mark stands without its letter where a line begins.
TEST_F(PdfText, CharactersOfManyBytesStayWhole) {
  for (const std::string one :
       {"\u00dfz\u03a9", "\u20acx", "\U0001d400y", "e\u0301o\u0308\u0304"}) {
    std::string word;
    while (word.size() < 20000) word += one;
    EXPECT_EQ(LettersDrawn(
                  [&](PdfPages& pages) {
                    pages.Table({{"1", "2"}, {"a", word}});
                  },
                  "12"),
              "a" + word);
  }
}

TEST_F(PdfText, FootersStayOnTheirPages) {
  const auto file = std::filesystem::path(testing::TempDir()) / "footer.pdf";
  WritePdf(file, {"title", "laboratory " + Numbered(5000, " ")},
           [](PdfPages& pages) { pages.Paragraph("text"); });
  const std::string text = e2e::LettersOf(file);
  EXPECT_THAT(text, testing::StartsWith("textpage1of1laboratory000000000000000001"));
  EXPECT_THAT(text, testing::EndsWith("..."));
  EXPECT_LT(text.size(), 1000u);
  std::filesystem::remove(file);
}

// Text that no font can show, of files and devices, names itself in place of stopping the writer.
TEST_F(PdfText, ControlCharactersAndOtherBytesAreNamed) {
  EXPECT_EQ(LettersDrawn([](PdfPages& pages) {
              pages.Title(
                  "a\x1b"
                  "b");
              pages.Table({{std::string("c\0d", 3), "\xff"}, {"e\xe2\x80\xae", "f\r"}});
              pages.Heading("g\x07");
              pages.Paragraph("h\x9b");
            }),
            "a\\x1bbc\\x00d\\xffe\\xe2\\x80\\xaef\\x0dg\\x07h\\x9b");
}

// Letters of 11 pixels are some 6.6 wide and 11 high. Limits of one point have one name.
TEST(PlotInPdf, NamesOfMarksDoNotLieOnEachOther) {
  IsoluxMap map = Map();
  map.marks.clear();
  for (const char* text : {"Segment 50", "50L", "50L", "50V", "75R", "Zone III"})
    map.marks.push_back({0.5, 0.5, text, false});
  const std::string svg = SvgIsolux(map);
  const std::regex name(
      "<text x=\"([0-9.]+)\" y=\"([0-9.]+)\" font-size=\"11\" text-anchor=\"(start|end)\" "
      "fill=\"#fff\"[^>]*>([^<]*)<");
  struct Box {
    double left, right, base;
  };
  std::vector<Box> boxes;
  for (std::sregex_iterator one(svg.begin(), svg.end(), name), none; one != none; ++one) {
    const double x = std::stod((*one)[1]), width = 6.6 * double((*one)[4].length());
    const double left = (*one)[3] == "end" ? x - width : x;
    boxes.push_back({left, left + width, std::stod((*one)[2])});
  }
  ASSERT_EQ(boxes.size(), 5u);
  for (std::size_t a = 0; a < boxes.size(); ++a)
    for (std::size_t b = 0; b < a; ++b)
      EXPECT_TRUE(boxes[a].right <= boxes[b].left + 0.1 || boxes[b].right <= boxes[a].left + 0.1 ||
                  std::abs(boxes[a].base - boxes[b].base) >= 10.9)
          << a << ' ' << b;
}

}  // namespace
}  // namespace luxfield::cli

// docs/mistakes.md: mistakes of users, and what is said. Every row of its tables is run, so that
// the page says what the program says; LUXFIELD_WRITE_MISTAKES=1 writes what is said into the page.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "luxfield/core/exr.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/measurements.h"
#include "program.h"

namespace luxfield::e2e {
namespace {

namespace fs = std::filesystem;

// The files that the page speaks of.
void MakeFiles(const fs::path& folder) {
  fs::copy(SourceFile("data"), folder / "data", fs::copy_options::recursive);
  lightfield::LuminaireGeometry geometry;
  geometry.delta_m = 0.3;
  geometry.grid.width = geometry.grid.height = 1;
  geometry.grid.spacing_m = 0.01;
  geometry.lattice = {1, 1, 0, 0, 0.01, 0.01};
  lightfield::LightField field;
  field.geometry = geometry;
  field.data = {1};
  lightfield::WriteLightField(folder / "x.lf.exr", field);
  lightfield::Measurements measurements;
  measurements.geometry = geometry;
  measurements.positions.resize(1);
  measurements.positions[0].irradiance = {1};
  measurements.positions[0].sigma = measurements.positions[0].count = {1};
  measurements.positions[0].mask = {0};
  lightfield::WriteMeasurements(folder / "x.meas.exr", measurements);
  core::WriteExrImage(folder / "picture.exr", core::Image(2, 2, 3));
  for (const auto& [session, plan] :
       {std::pair{"s", R"({"geometry": {}})"}, std::pair{"sensor", R"({"kind": "sensor"})"}}) {
    fs::create_directory(folder / session);
    WriteText(folder / session / "plan.json", plan);
  }
  fs::create_directory(folder / "empty");
  WriteText(folder / "lamp.ies", "IESNA:LM-63-2002\n");
  WriteText(folder / "lamp.ldt", "Lamps Ltd\n1\n");
  WriteText(folder / "lamp.ray", "rays\n");
  WriteText(folder / "photo.png", "\x89PNG\r\n\x1a\n");
  WriteText(folder / "response.cal.json", R"({"format": "luxfield response calibration"})");
}

// `| a | b |` as {"a", "b"}, without the backticks around them.
std::vector<std::string> Cells(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream stream(line.substr(1));
  for (std::string cell; std::getline(stream, cell, '|');) {
    if (cell.size() < 2) continue;
    cell = cell.substr(1, cell.size() - 2);  // the spaces
    const bool code = cell.size() > 2 && cell.front() == '`' && cell.back() == '`';
    cells.push_back(code ? cell.substr(1, cell.size() - 2) : cell);
  }
  return cells;
}

std::vector<std::string> Words(const std::string& command) {
  std::istringstream stream(command);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word == "\"\"" ? "" : word);
  return words;
}

// The command of a row: as typed; or, of a file in which a line was mistyped, one that reads it.
std::vector<std::string> CommandOf(const std::vector<std::string>& cells, const fs::path& folder) {
  if (cells.size() == 2) {
    auto words = Words(cells[0]);
    words.erase(words.begin());  // luxfield
    return words;
  }
  const std::string& file = cells.at(0);
  std::string text = ReadText(SourceFile(file));
  const auto at = text.find("\n" + cells.at(1));
  EXPECT_NE(at, std::string::npos) << file << " has no line " << cells.at(1);
  if (at != std::string::npos) text.replace(at + 1, cells[1].size(), cells.at(2));
  WriteText(folder / file, text);
  if (file.starts_with("data/plans/")) return {"plan", file, "--lab", "data/labs/small.toml"};
  if (file.starts_with("data/labs/")) return {"plan", "data/plans/small.toml", "--lab", file};
  return {"info", file};
}

std::vector<std::string> FilesIn(const fs::path& folder) {
  std::vector<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    files.push_back(entry.path().string());
  std::sort(files.begin(), files.end());
  return files;
}

TEST(Mistakes, AreAnsweredAsThePageSays) {
  const auto folder = FreshFolder("mistakes");
  MakeFiles(folder);
  const fs::path page = SourceFile("docs/mistakes.md");
  std::istringstream lines(ReadText(page));
  std::string written;
  int rows = 0;
  for (std::string line; std::getline(lines, line); written += line + "\n") {
    const bool row = line.starts_with("| `");
    if (!row) continue;
    auto cells = Cells(line);
    const auto command = CommandOf(cells, folder);
    const auto before = FilesIn(folder);
    const Outcome outcome = RunLuxfield(command, folder);
    SCOPED_TRACE(line);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_EQ(FilesIn(folder), before);
    EXPECT_THAT(outcome.err, testing::StartsWith("luxfield: "));
    const std::string said = outcome.err.substr(10, outcome.err.find('\n') - 10);
    EXPECT_EQ(outcome.err, "luxfield: " + said + "\n") << "more than one line";
    EXPECT_EQ(said, cells.back());
    if (cells.size() > 2) WriteText(folder / cells[0], ReadText(SourceFile(cells[0])));
    line = "|";
    for (std::size_t k = 0; k + 1 < cells.size(); ++k) line += " `" + cells[k] + "` |";
    line += " " + said + " |";
    ++rows;
  }
  EXPECT_GE(rows, 40);
  if (std::getenv("LUXFIELD_WRITE_MISTAKES")) WriteText(page, written);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace luxfield::e2e

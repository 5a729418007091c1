// Programs that tests of pages run: what they say, and what headless Chromium makes of a page.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "luxfield/core/file.h"

namespace luxfield::web {

inline std::string OutputOf(const std::string& command) {
  std::string out;
  std::FILE* pipe = ::popen(command.c_str(), "r");
  if (!pipe) return out;
  std::array<char, 4096> piece{};
  while (const std::size_t got = std::fread(piece.data(), 1, piece.size(), pipe))
    out.append(piece.data(), got);
  ::pclose(pipe);
  return out;
}

inline bool IsInstalled(const std::string& program) {
  return !OutputOf("command -v " + program).empty();
}

#define LUXFIELD_NEEDS_PROGRAM(program)                                                         \
  do {                                                                                          \
    if (IsInstalled(program)) break;                                                            \
    std::printf("SKIPPED: %s is not installed: JavaScript of the page is not tested with it\n", \
                program);                                                                       \
    GTEST_SKIP() << program << " is not installed";                                             \
  } while (false)

// What Chromium makes of a page: the document at the end, and its log.
struct Shown {
  std::string document, log;
};

inline Shown ShowInChromium(const std::filesystem::path& page) {
  const auto log = page.parent_path() / "log.txt";
  Shown shown;
  shown.document = OutputOf(fmt::format(
      "timeout 240 chromium --headless --no-sandbox --use-angle=swiftshader "
      "--enable-unsafe-swiftshader --enable-logging=stderr --v=0 --virtual-time-budget=20000 "
      "--user-data-dir={} --dump-dom file://{} 2> {}",
      (page.parent_path() / "profile").string(), page.string(), log.string()));
  shown.log = core::ReadFile(log);
  return shown;
}

// What a script more at the end of a page writes into its element <pre id="result">; else the
// browser's log.
inline std::string SaidByPage(std::string page, const std::string& script,
                              const std::filesystem::path& path) {
  page.insert(page.rfind("</body>"), "<script>" + script + "</script>\n");
  std::ofstream(path) << page;
  const Shown shown = ShowInChromium(path);
  const std::string opening = "<pre id=\"result\">";
  const auto begin = shown.document.find(opening);
  if (begin == shown.document.npos) return shown.log;
  const std::string rest = shown.document.substr(begin + opening.size());
  return rest.substr(0, rest.find("</pre>"));
}

}  // namespace luxfield::web

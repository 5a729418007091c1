#include "tests/e2e/html_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <vector>

namespace luxfield::e2e {
namespace {

// Elements without a closing tag.
bool IsVoid(const std::string& name) {
  return name == "meta" || name == "img" || name == "br" || name == "hr";
}

std::string Beginning(const std::string& text) { return text.substr(0, 120); }

bool IsNameCharacter(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '-'; }

// Whether "nan" or "inf" stands there as a word of its own.
bool HoldsNoNumber(const std::string& text) {
  for (const std::string word : {"nan", "inf"})
    for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) {
      const bool begins = at == 0 || !std::isalpha(static_cast<unsigned char>(text[at - 1])),
                 ends = at + 3 == text.size() ||
                        !std::isalpha(static_cast<unsigned char>(text[at + 3]));
      if (begins && ends) return true;
    }
  return false;
}

// Of text between tags, or of an attribute's value.
void CheckText(const std::string& text) {
  EXPECT_FALSE(HoldsNoNumber(text)) << Beginning(text);
  for (std::size_t at = text.find('&'); at != std::string::npos; at = text.find('&', at + 1)) {
    const std::string entity = text.substr(at, text.find(';', at) - at);
    EXPECT_TRUE(entity == "&amp" || entity == "&lt" || entity == "&gt" || entity == "&quot" ||
                entity == "&apos" || entity.starts_with("&#"))
        << Beginning(text.substr(at));
  }
}

// Of what stands between a tag's name and its end: name="value", any number of times.
void CheckAttributes(const std::string& text) {
  std::size_t at = 0;
  while (true) {
    at = text.find_first_not_of(" \n", at);
    if (at == std::string::npos || text.substr(at) == "/") return;
    while (at < text.size() && (IsNameCharacter(text[at]) || text[at] == ':')) ++at;
    ASSERT_EQ(text.substr(at, 2), "=\"") << Beginning(text);
    const std::size_t begin = at + 2, end = text.find('"', begin);
    ASSERT_NE(end, std::string::npos) << Beginning(text);
    CheckText(text.substr(begin, end - begin));
    at = end + 1;
  }
}

}  // namespace

void ExpectSelfContainedPage(const std::string& html) {
  for (const char* outside :
       {"src=", "href=", "<link", "<script", "url(http", "@import", "<iframe"})
    EXPECT_EQ(html.find(outside), std::string::npos) << outside;
  ASSERT_TRUE(html.starts_with("<!doctype html>")) << Beginning(html);
  for (const char* part : {"<title>", "<h1>", "<meta charset=\"utf-8\">"})
    EXPECT_NE(html.find(part), std::string::npos) << part;
  std::vector<std::string> open;
  std::size_t at = html.find('>') + 1;
  while (at < html.size()) {
    const std::size_t begin = std::min(html.find('<', at), html.size());
    if (open.empty() || open.back() != "style") CheckText(html.substr(at, begin - at));
    if (begin == html.size()) break;
    const std::size_t end = html.find('>', begin);
    ASSERT_NE(end, std::string::npos) << "a tag has no end: " << Beginning(html.substr(begin));
    const std::string tag = html.substr(begin + 1, end - begin - 1);
    if (tag.starts_with("/")) {
      ASSERT_FALSE(open.empty()) << tag;
      ASSERT_EQ(tag.substr(1), open.back());
      open.pop_back();
    } else {
      const std::string name = tag.substr(0, tag.find_first_of(" \n/"));
      CheckAttributes(tag.substr(name.size()));
      if (!tag.ends_with("/") && !IsVoid(name)) open.push_back(name);
    }
    at = end + 1;
  }
  EXPECT_TRUE(open.empty()) << open.back() << " is not closed";
}

}  // namespace luxfield::e2e

#include "luxfield/formats/xml.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include "luxfield/core/error.h"
#include "luxfield/core/printable.h"
#include "luxfield/formats/text_reader.h"

namespace luxfield::formats {
namespace {

constexpr std::size_t kMostElements = 1 << 21, kDeepest = 64;

bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

bool IsOfName(char c) {
  return !IsBlank(c) && std::string_view("<>/=\"'&!?").find(c) == std::string_view::npos &&
         static_cast<unsigned char>(c) > ' ';
}

void AppendUtf8(std::string& out, std::uint32_t code) {
  if (code < 0x80) {
    out += static_cast<char>(code);
  } else if (code < 0x800) {
    out += static_cast<char>(0xC0 | (code >> 6));
    out += static_cast<char>(0x80 | (code & 0x3F));
  } else if (code < 0x10000) {
    out += static_cast<char>(0xE0 | (code >> 12));
    out += static_cast<char>(0x80 | ((code >> 6) & 0x3F));
    out += static_cast<char>(0x80 | (code & 0x3F));
  } else {
    out += static_cast<char>(0xF0 | (code >> 18));
    out += static_cast<char>(0x80 | ((code >> 12) & 0x3F));
    out += static_cast<char>(0x80 | ((code >> 6) & 0x3F));
    out += static_cast<char>(0x80 | (code & 0x3F));
  }
}

// What is no character becomes U+FFFD.
std::string Utf8FromUtf16(std::string_view bytes, bool big_endian) {
  const auto unit = [&](std::size_t at) {
    const auto a = static_cast<unsigned char>(bytes[at]),
               b = static_cast<unsigned char>(bytes[at + 1]);
    return static_cast<std::uint32_t>(big_endian ? a << 8 | b : b << 8 | a);
  };
  std::string out;
  for (std::size_t at = 0; at + 1 < bytes.size(); at += 2) {
    std::uint32_t code = unit(at);
    if (code >= 0xD800 && code < 0xE000) {
      const bool pair =
          code < 0xDC00 && at + 3 < bytes.size() && unit(at + 2) >= 0xDC00 && unit(at + 2) < 0xE000;
      code = pair ? 0x10000 + ((code - 0xD800) << 10) + (unit(at + 2) - 0xDC00) : 0xFFFD;
      if (pair) at += 2;
    }
    AppendUtf8(out, code);
  }
  return out;
}

class Parser {
 public:
  Parser(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  XmlElement Document() {
    if (text_.starts_with("\xEF\xBB\xBF")) at_ = 3;
    std::optional<XmlElement> root;
    while (at_ < text_.size()) {
      if (text_[at_] == '<') {
        Markup(root);
      } else {
        Text(root);
      }
    }
    if (!open_.empty()) Fail(fmt::format("ends within <{}>", core::Printable(open_.back().name)));
    if (!root) Fail("holds no element");
    return std::move(*root);
  }

 private:
  [[noreturn]] void Fail(const std::string& problem) {
    throw InputError(file_, fmt::format("line {}: {}", Line(), problem), "have it exported anew");
  }

  // Lines are counted on, as `at_` only grows.
  std::size_t Line() {
    line_ += static_cast<std::size_t>(
        std::count(text_.begin() + static_cast<std::ptrdiff_t>(counted_),
                   text_.begin() + static_cast<std::ptrdiff_t>(at_), '\n'));
    counted_ = at_;
    return line_;
  }

  bool Starts(std::string_view word) const { return text_.substr(at_).starts_with(word); }

  // Behind the next `end`; InputError where there is none.
  std::string_view Until(std::string_view end, const char* what) {
    const auto to = text_.find(end, at_);
    if (to == std::string_view::npos) Fail(fmt::format("{} does not end", what));
    const auto between = text_.substr(at_, to - at_);
    at_ = to + end.size();
    return between;
  }

  void Markup(std::optional<XmlElement>& root) {
    if (Starts("<!--")) {
      at_ += 4;
      Until("-->", "a comment");
    } else if (Starts("<?")) {
      Until("?>", "a processing instruction");
    } else if (Starts("<![CDATA[")) {
      if (open_.empty()) Fail("text lies outside of all elements");
      at_ += 9;
      open_.back().text += Until("]]>", "character data");
    } else if (Starts("<!")) {
      Fail("has a document type, which may define entities and is not read");
    } else if (Starts("</")) {
      at_ += 2;
      Close(root);
    } else {
      ++at_;
      Open(root);
    }
  }

  std::string Name() {
    const std::size_t from = at_;
    while (at_ < text_.size() && IsOfName(text_[at_])) ++at_;
    std::string_view name = text_.substr(from, at_ - from);
    if (const auto colon = name.rfind(':'); colon != std::string_view::npos)
      name.remove_prefix(colon + 1);
    if (name.empty()) Fail("a name is missing");
    return std::string(name);
  }

  void SkipBlanks() {
    while (at_ < text_.size() && IsBlank(text_[at_])) ++at_;
  }

  void Open(std::optional<XmlElement>& root) {
    if (root) Fail("a second element lies beside the document's");
    if (++elements_ > kMostElements)
      Fail(fmt::format("holds more than {} elements", kMostElements));
    if (open_.size() == kDeepest)
      Fail(fmt::format("elements are nested more than {} deep", kDeepest));
    XmlElement element;
    element.line = Line();
    element.name = Name();
    for (SkipBlanks(); at_ < text_.size() && IsOfName(text_[at_]); SkipBlanks()) {
      std::string name = Name();
      SkipBlanks();
      if (!Starts("=")) Fail(fmt::format("attribute '{}' has no value", core::Printable(name)));
      ++at_;
      SkipBlanks();
      if (!Starts("\"") && !Starts("'"))
        Fail(fmt::format("the value of attribute '{}' is not quoted", core::Printable(name)));
      const char quote = text_[at_++];
      element.attributes.emplace_back(std::move(name),
                                      Decoded(Until(std::string_view(&quote, 1), "an attribute")));
    }
    const bool ends = Starts("/>");
    if (!ends && !Starts(">"))
      Fail(fmt::format("the tag <{}> does not end", core::Printable(element.name)));
    at_ += ends ? 2 : 1;
    open_.push_back(std::move(element));
    if (ends) Finish(root);
  }

  void Close(std::optional<XmlElement>& root) {
    const std::string name = Name();
    if (open_.empty() || open_.back().name != name)
      Fail(fmt::format("</{}> closes no open element", core::Printable(name)));
    SkipBlanks();
    if (!Starts(">")) Fail(fmt::format("the tag </{}> does not end", core::Printable(name)));
    ++at_;
    Finish(root);
  }

  void Finish(std::optional<XmlElement>& root) {
    XmlElement element = std::move(open_.back());
    open_.pop_back();
    element.text = Utf8FromLatin1(Trimmed(element.text));
    if (open_.empty())
      root = std::move(element);
    else
      open_.back().children.push_back(std::move(element));
  }

  void Text(const std::optional<XmlElement>&) {
    const auto to = std::min(text_.find('<', at_), text_.size());
    const std::string_view text = text_.substr(at_, to - at_);
    if (open_.empty()) {
      if (!Trimmed(text).empty()) Fail("text lies outside of all elements");
    } else {
      open_.back().text += Decoded(text);
    }
    at_ = to;
  }

  std::string Decoded(std::string_view text) {
    std::string out;
    while (!text.empty()) {
      const auto ampersand = std::min(text.find('&'), text.size());
      out += text.substr(0, ampersand);
      text.remove_prefix(ampersand);
      if (text.empty()) break;
      const auto end = text.find(';');
      if (end == std::string_view::npos || end > 12) Fail("'&' begins no reference");
      AppendReference(out, text.substr(1, end - 1));
      text.remove_prefix(end + 1);
    }
    return out;
  }

  void AppendReference(std::string& out, std::string_view name) {
    for (const auto& [known, character] :
         {std::pair{"lt", '<'}, std::pair{"gt", '>'}, std::pair{"amp", '&'}, std::pair{"quot", '"'},
          std::pair{"apos", '\''}})
      if (name == known) {
        out += character;
        return;
      }
    const bool hex = name.starts_with("#x");
    std::uint32_t code = 0;
    const std::string_view digits = name.substr(std::min<std::size_t>(name.size(), hex ? 2 : 1));
    const auto [end, error] =
        std::from_chars(digits.data(), digits.data() + digits.size(), code, hex ? 16 : 10);
    if (!name.starts_with("#") || digits.empty() || error != std::errc() ||
        end != digits.data() + digits.size() || code == 0 || code > 0x10FFFF ||
        (code >= 0xD800 && code < 0xE000))
      Fail(fmt::format("&{}; is not known", core::Printable(std::string(name))));
    AppendUtf8(out, code);
  }

  std::string_view text_;
  const std::string& file_;
  std::size_t at_ = 0, line_ = 1, counted_ = 0, elements_ = 0;
  std::vector<XmlElement> open_;
};

}  // namespace

const XmlElement* XmlElement::child(std::string_view wanted) const {
  for (const XmlElement& element : children)
    if (element.name == wanted) return &element;
  return nullptr;
}

const XmlElement* XmlElement::at(std::initializer_list<std::string_view> path) const {
  const XmlElement* element = this;
  for (const std::string_view step : path)
    if (element) element = element->child(step);
  return element;
}

std::string XmlElement::text_of(std::string_view wanted) const {
  const XmlElement* element = child(wanted);
  return element ? element->text : std::string();
}

std::string XmlElement::attribute(std::string_view wanted) const {
  for (const auto& [key, value] : attributes)
    if (key == wanted) return value;
  return {};
}

XmlElement ParseXml(std::string_view text, const std::string& file) {
  const bool big = text.starts_with("\xFE\xFF"), little = text.starts_with("\xFF\xFE");
  if (!big && !little) return Parser(text, file).Document();
  const std::string utf8 = Utf8FromUtf16(text.substr(2), big);
  return Parser(utf8, file).Document();
}

std::string XmlEscaped(std::string_view utf8) {
  return core::EscapedMarkup(core::Visible(Utf8FromLatin1(utf8)));
}

}  // namespace luxfield::formats

#include "luxfield/formats/obj_faces.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/printable.h"
#include "luxfield/formats/text_reader.h"

namespace luxfield::formats {
namespace {

using lightfield::Vec3;

constexpr double kMostCoordinate = 1e9;

class ObjReader {
 public:
  ObjReader(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  std::vector<FaceGroup> Groups() {
    while (!text_.empty()) {
      ++line_;
      const auto end = std::min(text_.find('\n'), text_.size());
      Line(text_.substr(0, end));
      text_.remove_prefix(std::min(end + 1, text_.size()));
    }
    if (!groups_.empty() && groups_.back().faces() == 0) groups_.pop_back();
    return std::move(groups_);
  }

 private:
  [[noreturn]] void Fail(const std::string& problem) const {
    throw InputError(file_, fmt::format("line {}: {}", line_, problem), "have it exported anew");
  }

  static std::string_view Word(std::string_view& rest) {
    rest = Trimmed(rest);
    std::size_t end = 0;
    while (end < rest.size() && rest[end] != ' ' && rest[end] != '\t') ++end;
    const std::string_view word = rest.substr(0, end);
    rest.remove_prefix(end);
    return word;
  }

  void Line(std::string_view rest) {
    const std::string_view word = Word(rest);
    if (word == "v")
      AddVertex(rest);
    else if (word == "f")
      AddFace(rest);
    else if ((word == "g" || word == "o") && !groups_.empty() && groups_.back().faces() > 0)
      groups_.emplace_back();
  }

  void AddVertex(std::string_view rest) {
    double p[3];
    for (double& x : p) {
      const std::string_view word = Word(rest);
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), x);
      if (error != std::errc() || end != word.data() + word.size() ||
          !(std::abs(x) < kMostCoordinate))
        Fail(fmt::format("'{}' is no coordinate", core::Printable(std::string(word))));
    }
    vertices_.push_back({p[0], p[1], p[2]});
  }

  // Of a word as 3, 3/1, 3//2 or -1.
  Vec3 Vertex(std::string_view word) const {
    long long index = 0;
    const std::string_view digits = word.substr(0, word.find('/'));
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), index);
    const auto count = static_cast<long long>(vertices_.size());
    if (index < 0) index += count + 1;
    if (error != std::errc() || end != digits.data() + digits.size() || index < 1 || index > count)
      Fail(fmt::format("'{}' is none of the {} vertices before it",
                       core::Printable(std::string(word)), count));
    return vertices_[static_cast<std::size_t>(index - 1)];
  }

  void AddFace(std::string_view rest) {
    std::string_view word = Word(rest);
    if (word.empty()) Fail("a face has no vertices");
    const Vec3 first = Vertex(word);
    Vec3 normal, before;
    int edges = 0;
    while (!(word = Word(rest)).empty()) {
      const Vec3 edge = Vertex(word) - first;
      if (++edges > 1) normal = normal + 0.5 * Cross(before, edge);
      before = edge;
    }
    if (edges < 2) Fail("a face has less than three vertices");
    if (groups_.empty()) groups_.emplace_back();
    FaceGroup& group = groups_.back();
    group.area_up_to.push_back(group.area_up_to.back() + Length(normal));
    group.normal_up_to.push_back(group.normal_up_to.back() + normal);
  }

  std::string_view text_;
  const std::string& file_;
  std::size_t line_ = 0;
  std::vector<Vec3> vertices_;
  std::vector<FaceGroup> groups_;
};

}  // namespace

std::vector<FaceGroup> ParseObjFaces(std::string_view text, const std::string& file) {
  return ObjReader(text, file).Groups();
}

}  // namespace luxfield::formats

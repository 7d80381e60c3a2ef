// Line by line; a vertex is kept in double until the middle of the mesh is known.
#include "core/simulation/mesh/obj_reader.h"

#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include <Eigen/Geometry>

#include "core/base/str_cat.h"
#include "core/scan/scan_reader.h"

namespace atlas {
namespace {

constexpr std::size_t kMaxFileBytes = std::size_t{1} << 30;
constexpr double kMaxCoordinate_m = 1e7;  // as poses
constexpr double kMaxExtent_m = 20e3;     // float32 is good to a millimetre 10 km from its zero

std::string_view NextWord(std::string_view& line) {
  const auto is_space = [](char c) {
    return c == ' ' || c == '\t' || c == '\r';
  };
  while (!line.empty() && is_space(line.front())) {
    line.remove_prefix(1);
  }
  std::size_t size = 0;
  while (size < line.size() && !is_space(line[size])) {
    ++size;
  }
  const std::string_view word = line.substr(0, size);
  line.remove_prefix(size);
  return word;
}

template <typename T>
std::optional<T> Number(std::string_view word) {
  if (!word.empty() && word.front() == '+') {
    word.remove_prefix(1);
  }
  T value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) {
    return std::nullopt;
  }
  return value;
}

std::string_view TakeLine(std::string_view& text) {
  const std::size_t end = text.find('\n');
  std::string_view line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  if (line.ends_with('\r')) {
    line.remove_suffix(1);
  }
  return line;
}

// By a backslash at its end, but not within a comment.
bool IsContinued(std::string_view line) {
  return line.ends_with('\\') && line.find('#') == std::string_view::npos;
}

class ObjParser {
 public:
  Status Line(std::string_view line) {
    line = line.substr(0, line.find('#'));
    const std::string_view keyword = NextWord(line);
    if (keyword == "v") {
      return Vertex(line);
    }
    return keyword == "f" ? Face(line) : Status();
  }

  Result<ObjMesh> Finish() {
    if (triangles_.empty()) {
      return Error(StatusCode::kInvalidData, "no face in it");
    }
    if (bounds_.sizes().maxCoeff() > kMaxExtent_m) {
      return Error(StatusCode::kInvalidData,
                   StrCat(bounds_.sizes().maxCoeff(), " m across: expected up to ", kMaxExtent_m));
    }
    ObjMesh result;
    result.origin_m = bounds_.center().array().round();
    result.mesh.vertices.reserve(vertices_.size());
    for (const Eigen::Vector3d& vertex : vertices_) {
      result.mesh.vertices.emplace_back((vertex - result.origin_m).cast<float>());
    }
    result.mesh.labels.assign(triangles_.size(), 0);
    result.mesh.triangles = std::move(triangles_);
    return result;
  }

 private:
  Status Vertex(std::string_view rest) {
    Eigen::Vector3d vertex;
    for (double& coordinate : vertex) {
      const std::string_view word = NextWord(rest);
      const std::optional<double> number = Number<double>(word);
      if (!number || !(std::abs(*number) <= kMaxCoordinate_m)) {
        return {StatusCode::kInvalidData,
                StrCat("coordinate '", word, "': expected three numbers up to 1e7 m")};
      }
      coordinate = *number;
    }
    if (vertices_.size() >= UINT32_MAX) {
      return {StatusCode::kInvalidData, "more than 2^32 vertices"};
    }
    vertices_.push_back(vertex);
    return {};
  }

  Status Face(std::string_view rest) {
    std::vector<std::uint32_t> corners;
    for (auto word = NextWord(rest); !word.empty(); word = NextWord(rest)) {
      const auto count = static_cast<std::int64_t>(vertices_.size());
      const auto number = Number<std::int64_t>(word.substr(0, word.find('/')));
      const bool is_there = number && *number != 0 && *number <= count && *number >= -count;
      if (!is_there) {
        return {StatusCode::kInvalidData,
                StrCat("corner '", word, "': expected one of the ", count, " vertices so far")};
      }
      corners.push_back(static_cast<std::uint32_t>(*number > 0 ? *number - 1 : count + *number));
    }
    if (corners.size() < 3) {
      return {StatusCode::kInvalidData,
              StrCat("a face of ", corners.size(), " corners: expected at least 3")};
    }
    for (std::size_t i = 2; i < corners.size(); ++i) {
      triangles_.push_back({corners[0], corners[i - 1], corners[i]});
    }
    for (const std::uint32_t corner : corners) {
      bounds_.extend(vertices_[corner]);
    }
    return {};
  }

  std::vector<Eigen::Vector3d> vertices_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  Eigen::AlignedBox3d bounds_;  // of what faces use
};

}  // namespace

Result<ObjMesh> ParseObj(std::string_view text, std::string_view name) {
  ObjParser parser;
  std::size_t lines = 1;
  for (std::size_t line_number = 1; !text.empty(); line_number += lines) {
    std::string joined;
    std::string_view line = TakeLine(text);
    for (lines = 1; IsContinued(line) && !text.empty(); ++lines) {
      joined.append(line.substr(0, line.size() - 1)).append(" ");
      line = TakeLine(text);
    }
    if (lines > 1) {
      line = joined.append(line);
    }
    if (const Status status = parser.Line(line); !status.ok()) {
      return Error(status.WithContext(StrCat(name, ": line ", line_number)));
    }
  }
  Result<ObjMesh> mesh = parser.Finish();
  return mesh ? std::move(mesh) : Error(mesh.error().WithContext(name));
}

Result<ObjMesh> ReadObj(const std::filesystem::path& path) {
  const Result<Bytes> bytes = ReadFileBytes(path, kMaxFileBytes);
  if (!bytes) {
    return Error(bytes.error());
  }
  return ParseObj({reinterpret_cast<const char*>(bytes->data()), bytes->size()}, path.string());
}

}  // namespace atlas

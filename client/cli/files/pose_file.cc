#include "client/cli/files/pose_file.h"

#include <array>
#include <charconv>
#include <map>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr std::size_t kWords = 15;

bool IsBlank(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

// The words of a line; more than asked for are counted, not kept.
std::size_t SplitWords(std::string_view line, std::array<std::string_view, kWords>& words) {
  std::size_t count = 0;
  std::size_t i = 0;
  while (i < line.size()) {
    while (i < line.size() && IsBlank(line[i])) ++i;
    const std::size_t begin = i;
    while (i < line.size() && !IsBlank(line[i])) ++i;
    if (i == begin) break;
    if (count < kWords) words[count] = line.substr(begin, i - begin);
    ++count;
  }
  return count;
}

template <typename T>
Status ReadNumber(std::string_view word, T& value) {
  const char* end = word.data() + word.size();
  const auto [position, error] = std::from_chars(word.data(), end, value);
  return error == std::errc() && position == end
             ? Status()
             : Status(StatusCode::kInvalidData,
                      StrCat("'", word.substr(0, 40), "' is not a number it can be"));
}

Status ReadKey(const std::array<std::string_view, kWords>& words, KeyframeKey& key) {
  key.session = {std::string(words[0]), std::string(words[1])};
  if (const Status status = key.Validate(); !status.ok()) {
    return {StatusCode::kInvalidData, status.message()};
  }
  return ReadNumber(words[2], key.sequence);
}

Result<PoseCorrection> ParseLine(std::string_view line) {
  std::array<std::string_view, kWords> words;
  if (const std::size_t count = SplitWords(line, words); count != kWords) {
    return Error(StatusCode::kInvalidData,
                 StrCat(count, " words, expected vehicle, session, sequence and 12 numbers"));
  }
  PoseCorrection correction;
  if (Status status = ReadKey(words, correction.key); !status.ok()) return Error(std::move(status));
  std::array<double, 12> numbers{};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (Status status = ReadNumber(words[3 + i], numbers[i]); !status.ok()) {
      return Error(std::move(status));
    }
  }
  const Result<Pose> pose = PoseFromRowMajor(numbers);
  if (!pose) return Error(pose.error());
  correction.T_world_sensor = QuantizedPose::FromPose(*pose);
  return correction;
}

}  // namespace

Result<std::vector<PoseCorrection>> ParsePoseFile(std::string_view text) {
  std::vector<PoseCorrection> corrections;
  std::map<KeyframeKey, std::size_t> line_of;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::size_t end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string_view::npos || line[first] == '#') continue;
    Result<PoseCorrection> correction = ParseLine(line);
    if (!correction) return Error(correction.error().WithContext(StrCat("line ", number)));
    const auto [earlier, is_new] = line_of.emplace(correction->key, number);
    if (!is_new) {
      return Error(StatusCode::kInvalidData,
                   StrCat("line ", number, ": keyframe ", correction->key, " has a pose on line ",
                          earlier->second, " already"));
    }
    corrections.push_back(*std::move(correction));
  }
  if (corrections.empty()) return Error(StatusCode::kInvalidData, "no pose in it");
  return corrections;
}

std::string PoseFileText(std::span<const PoseCorrection> corrections) {
  std::string text = "# vehicle session sequence and 12 numbers: 3x4 row-major, sensor to world\n";
  for (const PoseCorrection& correction : corrections) {
    text += StrCat(correction.key.session.vehicle, " ", correction.key.session.session, " ",
                   correction.key.sequence);
    for (const double number : PoseToRowMajor(correction.T_world_sensor.ToPose())) {
      std::array<char, 32> digits{};
      const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number);
      text.append(" ").append(digits.data(), end.ptr);
    }
    text += "\n";
  }
  return text;
}

}  // namespace atlas

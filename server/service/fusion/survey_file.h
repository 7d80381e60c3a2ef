// The surveys of one tile in a file: who wrote it, in which state of the atlas, and the bytes of
// TileSurveys::Save().
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>

#include "core/base/bytes.h"
#include "core/base/status.h"

namespace atlas {

struct SurveyFileHeader {
  std::uint64_t build = 0;               // BuildHash() of who wrote it
  std::array<std::uint8_t, 16> start{};  // the AtlasStart during which it was written
  std::uint64_t revision = 0;            // of the atlas that the surveys were made from
  std::uint64_t key = 0;                 // the tile's
  std::uint64_t payload_bytes = 0;

  friend bool operator==(const SurveyFileHeader&, const SurveyFileHeader&) = default;
};

// Of the running program's own file: surveys are those of its code, and packed as it lays them out.
// 0 if that cannot be read.
std::uint64_t BuildHash();

// Of a file that is as long as it says; nothing is said of its content. None: it is not one.
std::optional<SurveyFileHeader> ReadSurveyFileHeader(const std::filesystem::path& path);
// The payload, as it was written with that header. None: it is gone, cut, damaged or another one.
std::optional<Bytes> ReadSurveyFile(const std::filesystem::path& path,
                                    const SurveyFileHeader& expected);
std::size_t SurveyFileBytes(const SurveyFileHeader& header);

// Replaces the file once it is whole: until then it is `unfinished`, of the same directory. Waits
// for the disk: else the next transaction of the atlas, whose upload waits for its acknowledgement,
// would have to. kUnavailable: the disk refused; nothing is left behind.
Status WriteSurveyFile(const std::filesystem::path& path,
                       const std::filesystem::path& unfinished,
                       const SurveyFileHeader& header,
                       ByteSpan payload);

}  // namespace atlas

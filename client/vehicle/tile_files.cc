#include "client/vehicle/tile_files.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "client/vehicle/stored_file.h"
#include "core/base/disk_error.h"
#include "core/base/str_cat.h"
#include "core/tile/tile_codec.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

// Frozen.
constexpr std::uint32_t kTileMagic = 0x54564152;  // "RAVT"
constexpr std::uint8_t kVersion = 1;
constexpr std::string_view kTileSuffix = ".tile";

constexpr std::size_t kDigits = 16;
constexpr std::size_t kMaxFileBytes = kMaxTileBytes + 256;

std::string Hex(std::uint64_t value) {
  std::string digits(kDigits, '0');
  for (std::size_t i = 0; i < kDigits; ++i) {
    digits[kDigits - 1 - i] = "0123456789abcdef"[value >> (4 * i) & 15U];
  }
  return digits;
}

std::optional<std::uint64_t> FromHex(std::string_view digits) {
  std::uint64_t value = 0;
  const char* end = digits.data() + digits.size();
  const auto [stop, error] = std::from_chars(digits.data(), end, value, 16);
  return error == std::errc() && stop == end ? std::optional(value) : std::nullopt;
}

// KEY-HASH-REVISION-SECTIONS.tile, each 16 digits.
std::string NameOf(const TileFacts& facts) {
  return StrCat(Hex(facts.id.Key()), '-', Hex(facts.payload_hash), '-', Hex(facts.revision), '-',
                Hex(facts.sections), kTileSuffix);
}

std::optional<TileFacts> FactsFrom(std::string_view name) {
  constexpr std::size_t kNameSize = 4 * kDigits + 3 + kTileSuffix.size();
  if (name.size() != kNameSize || !name.ends_with(kTileSuffix)) return std::nullopt;
  std::array<std::uint64_t, 4> numbers{};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const auto number = FromHex(name.substr(i * (kDigits + 1), kDigits));
    if (!number) return std::nullopt;
    numbers[i] = *number;
  }
  const Result<TileId> id = TileId::FromKey(numbers[0]);
  if (!id) return std::nullopt;
  return TileFacts{*id, numbers[2], numbers[1], numbers[3]};
}

void RemoveFile(const fs::path& path) {
  std::error_code ignored;  // it is bounded by its bytes, and never believed without its checksum
  fs::remove(path, ignored);
}

// Files of the folder with their time of writing.
struct Dated {
  fs::file_time_type written;
  TileFiles::Found found;
};

}  // namespace

TileFiles::TileFiles(fs::path folder, Bytes atlas_id)
    : folder_(std::move(folder)), atlas_id_(std::move(atlas_id)) {}

Result<TileFiles> TileFiles::Open(const fs::path& root, const AtlasKey& atlas) {
  Result<fs::path> folder = OpenAtlasFolder(root, atlas);
  if (!folder) return Error(folder.error());
  return TileFiles(*std::move(folder), atlas.atlas_id);
}

fs::path TileFiles::PathOf(const TileFacts& facts) const {
  return folder_ / NameOf(facts);
}

Result<std::vector<TileFiles::Found>> TileFiles::List() {
  std::map<TileId, Dated> newest;
  std::error_code error;
  for (fs::directory_iterator entry(folder_, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (name.ends_with(kPartialSuffix)) RemoveFile(entry->path());
    const auto facts = FactsFrom(name);
    if (!facts) continue;
    std::error_code unreadable;
    Dated dated{entry->last_write_time(unreadable), {*facts, entry->file_size(unreadable)}};
    if (unreadable) continue;
    const auto [other, is_only] = newest.try_emplace(facts->id, dated);
    if (is_only) continue;
    if (other->second.found.facts.revision < facts->revision) std::swap(other->second, dated);
    Remove(dated.found.facts);
  }
  if (error) return Error(DiskError("cannot read folder", folder_, error.value()));
  std::vector<Dated> by_time;
  by_time.reserve(newest.size());
  for (const auto& [id, dated] : newest) {
    by_time.push_back(dated);
  }
  std::stable_sort(by_time.begin(), by_time.end(),
                   [](const Dated& a, const Dated& b) { return a.written < b.written; });
  std::vector<Found> all;
  all.reserve(by_time.size());
  for (const Dated& dated : by_time) {
    all.push_back(dated.found);
  }
  return all;
}

Result<std::uint64_t> TileFiles::Write(const TileFacts& facts, ByteSpan blob) {
  ByteWriter out;
  out.U32(kTileMagic);
  out.U8(kVersion);
  out.Raw(atlas_id_);
  for (const std::uint64_t number :
       {facts.id.Key(), facts.payload_hash, facts.revision, facts.sections}) {
    out.U64(number);
  }
  out.U32(static_cast<std::uint32_t>(blob.size()));
  out.Raw(blob);
  const Bytes file = WithChecksum(out.Take());
  Status status = StoreFile(PathOf(facts), file, Durability::kWhole);
  if (!status.ok()) return Error(std::move(status));
  return file.size();
}

Result<Bytes> TileFiles::Read(const TileFacts& facts) const {
  const Result<Bytes> file = LoadFile(PathOf(facts), kMaxFileBytes);
  if (!file) return Error(file.error());
  const Result<ByteSpan> content = WithoutChecksum(*file);
  if (!content) return Error(content.error().WithContext(NameOf(facts)));
  ByteReader in(*content);
  bool is_it = in.U32() == kTileMagic && in.U8() == kVersion;
  is_it = std::ranges::equal(in.Raw(kAtlasIdBytes), atlas_id_) && is_it;
  for (const std::uint64_t number :
       {facts.id.Key(), facts.payload_hash, facts.revision, facts.sections}) {
    is_it = in.U64() == number && is_it;
  }
  const ByteSpan blob = in.Raw(in.U32());
  if (!is_it || !in.ok() || in.remaining() != 0) {
    return Error(StatusCode::kInvalidData, StrCat(NameOf(facts), ": holds something else"));
  }
  return Bytes(blob.begin(), blob.end());
}

void TileFiles::Remove(const TileFacts& facts) {
  RemoveFile(PathOf(facts));
}

}  // namespace atlas

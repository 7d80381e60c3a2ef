#include "core/tile/tile_container.h"

#include <algorithm>
#include <utility>

#include "core/base/compression.h"
#include "core/base/hash.h"
#include "core/base/str_cat.h"
#include "core/tile/tile_codec.h"

namespace atlas {
namespace {

constexpr std::uint32_t kMagic = 0x31544152;  // "RAT1"
constexpr std::uint8_t kVersion = 2;
constexpr std::size_t kMaxSections = 64;
constexpr int kCompressionLevel = 3;  // measured: docs/formats/tile.md

struct TableEntry {
  std::uint16_t id = 0;
  std::uint32_t uncompressed = 0;
  std::uint32_t compressed = 0;
  std::uint64_t hash = 0;  // of the compressed bytes
};

Status Damaged(const char* what) {
  return Status(StatusCode::kInvalidData, StrCat("tile: ", what));
}

Status ReadVersion(ByteReader& in) {
  if (in.U32() != kMagic) {
    return Damaged("does not start with RAT1");
  }
  const std::uint8_t version = in.U8();
  if (!in.ok() || version == 0) {
    return Damaged("version 0 or a truncated header");
  }
  if (version != kVersion) {
    return Status(StatusCode::kUnsupported,
                  StrCat("tile: version ", int{version}, ", this build reads ", int{kVersion}));
  }
  return {};
}

Status ReadTable(ByteReader& in, std::vector<TableEntry>& table) {
  const std::size_t count = in.U16();
  if (!in.ok() || count > kMaxSections) {
    return Damaged("header is truncated or has too many sections");
  }
  std::size_t total = 0;
  for (std::size_t i = 0; i < count; ++i) {
    TableEntry entry;
    entry.id = in.U16();
    entry.uncompressed = in.U32();
    entry.compressed = in.U32();
    entry.hash = in.U64();
    total += entry.uncompressed;
    if (!in.ok() || total > kMaxTileBytes || (!table.empty() && entry.id <= table.back().id)) {
      return Damaged("section table is truncated, out of order or too large");
    }
    table.push_back(entry);
  }
  return {};
}

Status CheckHeaderHash(ByteSpan blob, ByteReader& in) {
  const ByteSpan header = blob.first(in.position());
  const std::uint64_t stored = in.U64();
  return in.ok() && stored == Hash64(header) ? Status() : Damaged("header checksum does not match");
}

// A blob without a look into its sections.
struct RawSection {
  TableEntry entry;
  ByteSpan compressed;
};
struct RawContainer {
  std::uint64_t key = 0;
  std::uint64_t profile_hash = 0;
  std::uint8_t preset = 0;
  std::vector<RawSection> sections;
};

Status ReadRaw(ByteSpan blob, RawContainer& container) {
  if (blob.size() > kMaxTileBytes) {
    return Damaged("blob is too large");
  }
  ByteReader in(blob);
  ATLAS_RETURN_IF_ERROR(ReadVersion(in));
  container.key = in.U64();
  container.profile_hash = in.U64();
  container.preset = in.U8();
  std::vector<TableEntry> table;
  ATLAS_RETURN_IF_ERROR(ReadTable(in, table));
  ATLAS_RETURN_IF_ERROR(CheckHeaderHash(blob, in));
  for (const TableEntry& entry : table) {
    container.sections.push_back({entry, in.Raw(entry.compressed)});
    if (!in.ok()) {
      return Status(StatusCode::kInvalidData,
                    StrCat("tile: section ", entry.id, " is truncated or damaged"));
    }
  }
  return in.remaining() == 0 ? Status() : Damaged("bytes are left after the last section");
}

Bytes WriteRaw(const RawContainer& container) {
  ByteWriter out;
  out.U32(kMagic);
  out.U8(kVersion);
  out.U64(container.key);
  out.U64(container.profile_hash);
  out.U8(container.preset);
  out.U16(static_cast<std::uint16_t>(container.sections.size()));
  for (const RawSection& section : container.sections) {
    out.U16(section.entry.id);
    out.U32(section.entry.uncompressed);
    out.U32(section.entry.compressed);
    out.U64(section.entry.hash);
  }
  out.U64(Hash64(out.bytes()));
  for (const RawSection& section : container.sections) {
    out.Raw(section.compressed);
  }
  return out.Take();
}

Result<Bytes> Unpack(const RawSection& section) {
  const TableEntry& entry = section.entry;
  if (Hash64(section.compressed) != entry.hash) {
    return Error(StatusCode::kInvalidData,
                 StrCat("tile: section ", entry.id, " is truncated or damaged"));
  }
  Result<Bytes> content = Decompress(section.compressed, entry.uncompressed);
  if (!content) {
    return Error(content.error().WithContext(StrCat("tile: section ", entry.id)));
  }
  return content;
}

}  // namespace

const TileContainer::Section* TileContainer::Find(std::uint16_t id) const {
  const auto found =
      std::find_if(sections.begin(), sections.end(), [id](const Section& s) { return s.id == id; });
  return found == sections.end() ? nullptr : &*found;
}

Bytes EncodeContainerPayload(const TileContainer& container) {
  ByteWriter out;
  out.U64(container.key);
  out.U64(container.profile_hash);
  for (const TileContainer::Section& section : container.sections) {
    out.U16(section.id);
    out.U32(static_cast<std::uint32_t>(section.content.size()));
    out.Raw(section.content);
  }
  return out.Take();
}

Bytes EncodeContainer(const TileContainer& container) {
  RawContainer raw{container.key, container.profile_hash, container.preset, {}};
  std::vector<Bytes> compressed;
  compressed.reserve(container.sections.size());
  for (const TileContainer::Section& section : container.sections) {
    const Bytes& bytes = compressed.emplace_back(Compress(section.content, kCompressionLevel));
    const TableEntry entry{section.id, static_cast<std::uint32_t>(section.content.size()),
                           static_cast<std::uint32_t>(bytes.size()), Hash64(bytes)};
    raw.sections.push_back({entry, bytes});
  }
  return WriteRaw(raw);
}

Result<TileContainer> DecodeContainer(ByteSpan blob) {
  RawContainer raw;
  if (Status status = ReadRaw(blob, raw); !status.ok()) {
    return Error(std::move(status));
  }
  TileContainer container{raw.key, raw.profile_hash, raw.preset, {}};
  for (const RawSection& section : raw.sections) {
    Result<Bytes> content = Unpack(section);
    if (!content) {
      return Error(content.error());
    }
    container.sections.push_back({section.entry.id, *std::move(content)});
  }
  return container;
}

Result<Bytes> SelectSections(ByteSpan blob, SectionMask sections) {
  RawContainer raw;
  if (Status status = ReadRaw(blob, raw); !status.ok()) {
    return Error(std::move(status));
  }
  std::erase_if(raw.sections, [sections](const RawSection& section) {
    const std::uint16_t id = section.entry.id;
    return id < 64 ? (sections >> id & 1u) == 0 : sections != kAllSections;
  });
  return WriteRaw(raw);
}

Result<Bytes> MergeSections(ByteSpan blob, ByteSpan added) {
  RawContainer merged;
  RawContainer second;
  for (const auto& [bytes, raw] : {std::pair{added, &merged}, {blob, &second}}) {
    if (Status status = ReadRaw(bytes, *raw); !status.ok()) {
      return Error(std::move(status));
    }
  }
  if (merged.key != second.key || merged.profile_hash != second.profile_hash) {
    return Error(StatusCode::kInvalidArgument,
                 "tile: sections of different tiles do not go together");
  }
  // The first of equals stays.
  merged.sections.insert(merged.sections.end(), second.sections.begin(), second.sections.end());
  std::stable_sort(
      merged.sections.begin(), merged.sections.end(),
      [](const RawSection& a, const RawSection& b) { return a.entry.id < b.entry.id; });
  const auto end = std::unique(
      merged.sections.begin(), merged.sections.end(),
      [](const RawSection& a, const RawSection& b) { return a.entry.id == b.entry.id; });
  merged.sections.erase(end, merged.sections.end());
  return WriteRaw(merged);
}

}  // namespace atlas

#include "core/tile/tile_container.h"

#include <algorithm>

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

Result<Bytes> ReadSection(ByteReader& in, const TableEntry& entry) {
  const ByteSpan compressed = in.Raw(entry.compressed);
  if (!in.ok() || Hash64(compressed) != entry.hash) {
    return Error(StatusCode::kInvalidData,
                 StrCat("tile: section ", entry.id, " is truncated or damaged"));
  }
  Result<Bytes> content = Decompress(compressed, entry.uncompressed);
  if (!content) {
    return Error(content.error().WithContext(StrCat("tile: section ", entry.id)));
  }
  return content;
}

Status ReadContainer(ByteSpan blob, TileContainer& container) {
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
    Result<Bytes> content = ReadSection(in, entry);
    if (!content) {
      return content.error();
    }
    container.sections.push_back({entry.id, *std::move(content)});
  }
  return in.remaining() == 0 ? Status() : Damaged("bytes are left after the last section");
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
  ByteWriter out;
  out.U32(kMagic);
  out.U8(kVersion);
  out.U64(container.key);
  out.U64(container.profile_hash);
  out.U8(container.preset);
  out.U16(static_cast<std::uint16_t>(container.sections.size()));
  Bytes bodies;
  for (const TileContainer::Section& section : container.sections) {
    const Bytes compressed = Compress(section.content, kCompressionLevel);
    out.U16(section.id);
    out.U32(static_cast<std::uint32_t>(section.content.size()));
    out.U32(static_cast<std::uint32_t>(compressed.size()));
    out.U64(Hash64(compressed));
    bodies.insert(bodies.end(), compressed.begin(), compressed.end());
  }
  out.U64(Hash64(out.bytes()));
  out.Raw(bodies);
  return out.Take();
}

Result<TileContainer> DecodeContainer(ByteSpan blob) {
  TileContainer container;
  if (Status status = ReadContainer(blob, container); !status.ok()) {
    return Error(std::move(status));
  }
  return container;
}

}  // namespace atlas

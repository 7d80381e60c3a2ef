#include "core/tile/raw_container.h"

#include <utility>

#include "core/base/hash.h"
#include "core/base/str_cat.h"
#include "core/tile/tile_codec.h"

namespace atlas {
namespace {

constexpr std::uint8_t kVersion = 2;
constexpr std::size_t kMaxSections = 64;

struct TableEntry {
  RawSection section;
  std::uint32_t compressed_bytes = 0;
};

Status Damaged(const char* what) {
  return Status(StatusCode::kInvalidData, StrCat("tile: ", what));
}

Status ReadVersion(ByteReader& in, std::uint32_t magic) {
  if (in.U32() != magic) {
    return Damaged(magic == kTileMagic ? "does not start with RAT1" : "does not start with RAD1");
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
    entry.section.id = in.U16();
    entry.section.uncompressed_bytes = in.U32();
    entry.compressed_bytes = in.U32();
    entry.section.hash = in.U64();
    total += entry.section.uncompressed_bytes;
    const bool is_rising = table.empty() || entry.section.id > table.back().section.id;
    if (!in.ok() || total > kMaxTileBytes || !is_rising) {
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

Status Read(ByteSpan blob, std::uint32_t magic, RawContainer& container) {
  if (blob.size() > kMaxTileBytes) {
    return Damaged("blob is too large");
  }
  ByteReader in(blob);
  ATLAS_RETURN_IF_ERROR(ReadVersion(in, magic));
  container.key = in.U64();
  container.profile_hash = in.U64();
  container.preset = in.U8();
  std::vector<TableEntry> table;
  ATLAS_RETURN_IF_ERROR(ReadTable(in, table));
  ATLAS_RETURN_IF_ERROR(CheckHeaderHash(blob, in));
  for (const TableEntry& entry : table) {
    container.sections.push_back(entry.section);
    container.sections.back().compressed = in.Raw(entry.compressed_bytes);
    if (!in.ok()) {
      return Status(StatusCode::kInvalidData,
                    StrCat("tile: section ", entry.section.id, " is truncated or damaged"));
    }
  }
  return in.remaining() == 0 ? Status() : Damaged("bytes are left after the last section");
}

}  // namespace

Result<RawContainer> ReadRaw(ByteSpan blob, std::uint32_t magic) {
  RawContainer container;
  if (Status status = Read(blob, magic, container); !status.ok()) {
    return Error(std::move(status));
  }
  return container;
}

Bytes WriteRaw(const RawContainer& container, std::uint32_t magic) {
  ByteWriter out;
  out.U32(magic);
  out.U8(kVersion);
  out.U64(container.key);
  out.U64(container.profile_hash);
  out.U8(container.preset);
  out.U16(static_cast<std::uint16_t>(container.sections.size()));
  for (const RawSection& section : container.sections) {
    out.U16(section.id);
    out.U32(section.uncompressed_bytes);
    out.U32(static_cast<std::uint32_t>(section.compressed.size()));
    out.U64(section.hash);
  }
  out.U64(Hash64(out.bytes()));
  for (const RawSection& section : container.sections) {
    out.Raw(section.compressed);
  }
  return out.Take();
}

}  // namespace atlas

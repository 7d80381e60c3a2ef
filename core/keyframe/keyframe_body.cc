#include "core/keyframe/keyframe_body.h"

#include <algorithm>
#include <bit>
#include <span>
#include <vector>

#include "core/base/planes.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr int kAltitudePlanes = 2;
constexpr int kMaxColumnNibbles = 16;

std::uint8_t StateNibble(const KeyframeCell& cell) {
  return static_cast<std::uint8_t>(static_cast<unsigned>(cell.source) |
                                   (static_cast<unsigned>(cell.occupancy) << 2));
}

// Differences wrap at 16 bits, so that every pair of values has one.
std::uint32_t WrappedDifference(std::int16_t value, std::int16_t previous) {
  return Zigzag(static_cast<std::int16_t>(value - previous));
}

std::int16_t AddWrapped(std::int16_t previous, std::uint32_t zigzag) {
  return static_cast<std::int16_t>(previous + Unzigzag(zigzag));
}

Bytes StateNibbles(std::span<const KeyframeCell> cells) {
  Bytes states(cells.size());
  std::transform(cells.begin(), cells.end(), states.begin(), StateNibble);
  return states;
}

// Along the rows, each seen cell against the seen cell before it; a row's first against the first
// of the row before.
template <typename Visit>
void VisitAltitudes(std::size_t side, std::span<KeyframeCell> cells, const Visit& visit) {
  std::int16_t row_first = 0;
  for (std::size_t begin = 0; begin < cells.size(); begin += side) {
    std::int16_t previous = row_first;
    bool is_first = true;
    for (KeyframeCell& cell : cells.subspan(begin, side)) {
      if (cell.source == AltitudeSource::kNone) {
        continue;
      }
      visit(cell, previous);
      previous = cell.altitude_mm;
      row_first = is_first ? previous : row_first;
      is_first = false;
    }
  }
}

void WriteAltitudes(const Keyframe& keyframe, ByteWriter& out) {
  std::vector<KeyframeCell> cells = keyframe.cells;
  std::vector<std::uint32_t> differences;
  differences.reserve(cells.size());
  VisitAltitudes(static_cast<std::size_t>(keyframe.grid.side()), cells,
                 [&](const KeyframeCell& cell, std::int16_t previous) {
                   differences.push_back(WrappedDifference(cell.altitude_mm, previous));
                 });
  WritePlanes(differences, kAltitudePlanes, out);
}

void WriteAnchors(const Keyframe& keyframe, ByteWriter& out) {
  std::vector<std::uint32_t> differences;
  differences.reserve(keyframe.anchors.size());
  std::int16_t previous = 0;
  for (const std::int16_t anchor : keyframe.anchors) {
    differences.push_back(WrappedDifference(anchor, previous));
    previous = anchor;
  }
  WritePlanes(differences, kAltitudePlanes, out);
}

// How many nibbles the tallest column needs.
int ColumnNibbles(std::span<const std::uint64_t> columns) {
  std::uint64_t all = 0;
  for (const std::uint64_t column : columns) {
    all |= column;
  }
  return (static_cast<int>(std::bit_width(all)) + 3) / 4;
}

void WriteColumns(const Keyframe& keyframe, ByteWriter& out) {
  Bytes has_column;
  std::vector<std::uint64_t> columns;
  has_column.reserve(keyframe.cells.size());
  columns.reserve(keyframe.cells.size());
  for (std::size_t i = 0; i < keyframe.cells.size(); ++i) {
    if (keyframe.cells[i].source == AltitudeSource::kNone) {
      continue;
    }
    has_column.push_back(keyframe.columns[i] != 0 ? 1 : 0);
    if (keyframe.columns[i] != 0) {
      columns.push_back(keyframe.columns[i]);
    }
  }
  const int nibbles = ColumnNibbles(columns);
  WriteBits(has_column, out);
  out.U8(static_cast<std::uint8_t>(nibbles));
  WriteNibblePlanes(columns, nibbles, out);
}

Status ReadStates(ByteReader& in, Keyframe& keyframe, std::size_t& seen) {
  const Bytes states = ReadNibbles(in, keyframe.grid.size());
  if (!in.ok()) {
    return Status(StatusCode::kInvalidData, "keyframe: states are truncated");
  }
  keyframe.cells.resize(states.size());
  seen = 0;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const unsigned source = states[i] & 3u;
    const unsigned occupancy = states[i] >> 2u;
    if (source == 0 && occupancy != 0) {
      return Status(StatusCode::kInvalidData,
                    StrCat("keyframe: cell ", i, " has state ", unsigned{states[i]}));
    }
    keyframe.cells[i].source = static_cast<AltitudeSource>(source);
    keyframe.cells[i].occupancy = static_cast<Occupancy>(occupancy);
    seen += source != 0 ? 1 : 0;
  }
  return {};
}

Status ReadAltitudes(ByteReader& in, std::size_t seen, Keyframe& keyframe) {
  const std::vector<std::uint32_t> differences = ReadPlanes(in, seen, kAltitudePlanes);
  if (!in.ok()) {
    return Status(StatusCode::kInvalidData, "keyframe: altitudes are truncated");
  }
  std::size_t next = 0;
  VisitAltitudes(static_cast<std::size_t>(keyframe.grid.side()), keyframe.cells,
                 [&](KeyframeCell& cell, std::int16_t previous) {
                   cell.altitude_mm = AddWrapped(previous, differences[next]);
                   ++next;
                 });
  return {};
}

Status ReadAnchors(ByteReader& in, Keyframe& keyframe) {
  const std::vector<std::uint32_t> differences =
      ReadPlanes(in, keyframe.block_count(), kAltitudePlanes);
  if (!in.ok()) {
    return Status(StatusCode::kInvalidData, "keyframe: anchors are truncated");
  }
  std::int16_t previous = 0;
  keyframe.anchors.reserve(differences.size());
  for (const std::uint32_t difference : differences) {
    previous = AddWrapped(previous, difference);
    keyframe.anchors.push_back(previous);
  }
  return {};
}

// Gives each cell with a column its word. False when a column is empty.
bool SpreadColumns(std::span<const std::uint8_t> has_column,
                   std::span<const std::uint64_t> words,
                   Keyframe& keyframe) {
  std::size_t seen = 0;
  std::size_t next = 0;
  for (std::size_t i = 0; i < keyframe.cells.size(); ++i) {
    if (keyframe.cells[i].source == AltitudeSource::kNone || has_column[seen++] == 0) {
      continue;
    }
    keyframe.columns[i] = words[next++];
    if (keyframe.columns[i] == 0) {
      return false;
    }
  }
  return true;
}

Status ReadColumns(ByteReader& in, std::size_t seen, Keyframe& keyframe) {
  const Bytes has_column = ReadBits(in, seen);
  const int nibbles = in.U8();
  if (!in.ok() || nibbles > kMaxColumnNibbles) {
    return Status(StatusCode::kInvalidData, "keyframe: columns are truncated or too tall");
  }
  const auto count =
      static_cast<std::size_t>(std::count(has_column.begin(), has_column.end(), std::uint8_t{1}));
  if (in.remaining() != (count + 1) / 2 * static_cast<std::size_t>(nibbles)) {
    return Status(StatusCode::kInvalidData, "keyframe: columns are truncated or bytes are left");
  }
  std::vector<std::uint64_t> words(count);
  ReadNibblePlanes(in, nibbles, words);
  keyframe.columns.resize(keyframe.cells.size());
  if (!in.ok() || ColumnNibbles(words) != nibbles || !SpreadColumns(has_column, words, keyframe)) {
    return Status(StatusCode::kInvalidData, "keyframe: columns are not in their one encoding");
  }
  return {};
}

}  // namespace

std::size_t MaxKeyframeBodyBytes(const GridGeometry& grid) {
  Keyframe frame;
  frame.grid = grid;
  const std::size_t cells = grid.size();
  return cells / 2 + 2 * cells + 2 * frame.block_count() + cells / 8 + 2 + 8 * cells +
         kMaxColumnNibbles;
}

Bytes EncodeKeyframeBody(const Keyframe& keyframe) {
  ByteWriter out;
  WriteNibbles(StateNibbles(keyframe.cells), out);
  WriteAltitudes(keyframe, out);
  WriteAnchors(keyframe, out);
  WriteColumns(keyframe, out);
  return out.Take();
}

Status DecodeKeyframeBody(ByteSpan body, Keyframe& keyframe) {
  ByteReader in(body);
  std::size_t seen = 0;
  ATLAS_RETURN_IF_ERROR(ReadStates(in, keyframe, seen));
  ATLAS_RETURN_IF_ERROR(ReadAltitudes(in, seen, keyframe));
  ATLAS_RETURN_IF_ERROR(ReadAnchors(in, keyframe));
  return ReadColumns(in, seen, keyframe);
}

}  // namespace atlas

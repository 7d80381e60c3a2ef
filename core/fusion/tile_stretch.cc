#include "core/fusion/tile_stretch.h"

#include <utility>

#include "core/base/small_sort.h"

namespace atlas {
namespace {

void SaveMember(const StretchMember& frame, ByteWriter& out) {
  out.Varint(frame.sequence);
  out.SignedVarint(frame.radius_cells);
  out.SignedVarint(frame.time_ms);
  out.U64(frame.content);
  out.SignedVarint(frame.placement.x_um);
  out.SignedVarint(frame.placement.y_um);
  out.SignedVarint(frame.placement.z_um);
  out.I32(frame.placement.cos_yaw);
  out.I32(frame.placement.sin_yaw);
  out.I32(frame.placement.slope_x);
  out.I32(frame.placement.slope_y);
}

StretchMember LoadMember(ByteReader& in) {
  StretchMember frame;
  frame.sequence = static_cast<std::uint32_t>(in.Varint());
  frame.radius_cells = static_cast<std::int32_t>(in.SignedVarint());
  frame.time_ms = in.SignedVarint();
  frame.content = in.U64();
  frame.placement.x_um = in.SignedVarint();
  frame.placement.y_um = in.SignedVarint();
  frame.placement.z_um = in.SignedVarint();
  frame.placement.cos_yaw = in.I32();
  frame.placement.sin_yaw = in.I32();
  frame.placement.slope_x = in.I32();
  frame.placement.slope_y = in.I32();
  return frame;
}

}  // namespace

std::size_t TileStretch::bytes() const {
  return sizeof(*this) + frames.capacity() * sizeof(StretchMember) +
         times_ms.capacity() * sizeof(std::int64_t) + (open ? open->bytes() : 0);
}

void TileStretch::Save(ByteWriter& out) const {
  out.String(key.vehicle);
  out.String(key.session);
  out.Varint(number);
  out.Varint(session);
  out.Varint(vehicle);
  out.U8(has_forgotten ? 1 : 0);
  out.Varint(grown_at);
  out.SignedVarint(tile_time_ms);
  out.Varint(frames.size());
  for (const StretchMember& frame : frames) {
    SaveMember(frame, out);
  }
  out.U8(open ? 1 : 0);
  if (open) {
    const Bytes packed = open->PackedCopy();
    out.Varint(packed.size());
    out.Raw(packed);
  }
}

TileStretch TileStretch::Load(ByteReader& in, const TileId& id, const MapProfile& profile) {
  TileStretch stretch;
  stretch.key.vehicle = in.String(kMaxNameSize);
  stretch.key.session = in.String(kMaxNameSize);
  stretch.number = static_cast<std::uint32_t>(in.Varint());
  stretch.session = static_cast<std::uint32_t>(in.Varint());
  stretch.vehicle = static_cast<std::uint32_t>(in.Varint());
  stretch.has_forgotten = in.U8() != 0;
  stretch.grown_at = static_cast<std::uint32_t>(in.Varint());
  stretch.tile_time_ms = in.SignedVarint();
  const std::uint64_t count = in.Varint();
  std::vector<StretchFrame> surveyed;
  for (std::uint64_t i = 0; i < count && in.ok(); ++i) {
    const StretchMember& frame = stretch.frames.emplace_back(LoadMember(in));
    stretch.times_ms.push_back(frame.time_ms);
    surveyed.push_back({frame.sequence, frame.time_ms});
  }
  if (in.U8() != 0) {
    const ByteSpan packed = in.Raw(in.Varint());
    stretch.open.emplace(TileBand{id, 0, profile.tile_cells}, profile, std::move(surveyed),
                         Bytes(packed.begin(), packed.end()));
  }
  return stretch;
}

void CollectOpen(std::size_t cell,
                 std::uint32_t place,
                 std::span<TileStretch> stretches,
                 std::vector<SegmentView>& segments) {
  StretchSurvey& open = *stretches[place].open;
  for (std::uint32_t i = open.First(cell); i != Segment::kNone; i = open.At(i).next) {
    segments.push_back(ViewOf(open.At(i), place, stretches));
  }
}

void SortByStretch(std::vector<SegmentView>& segments) {
  const auto is_before = [](const SegmentView& a, const SegmentView& b) {
    return a.stretch < b.stretch;
  };
  SmallStableSort(segments.begin(), segments.end(), is_before);
}

}  // namespace atlas

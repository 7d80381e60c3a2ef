// A submap as bytes: magic, radius, tiles, features, places, and Hash64 of all that.
#include "core/alignment/submap_codec.h"

#include <algorithm>
#include <bit>

#include "core/base/hash.h"

namespace atlas {
namespace {

constexpr std::uint32_t kMagic = 0x3150'4D53;  // "SMP1"
constexpr std::size_t kChecksumBytes = 8;
constexpr std::size_t kPointBytes = 12;
constexpr std::size_t kPlaceBytes = 3 * 8 + RangeProfile::kBands * RangeProfile::kSectors;

void WriteDouble(double value, ByteWriter& out) {
  out.U64(std::bit_cast<std::uint64_t>(value));
}

double ReadDouble(ByteReader& in) {
  return std::bit_cast<double>(in.U64());
}

void WritePoints(const std::vector<Eigen::Vector3f>& points, ByteWriter& out) {
  out.U32(static_cast<std::uint32_t>(points.size()));
  for (const Eigen::Vector3f& p : points) {
    for (int axis = 0; axis < 3; ++axis) out.U32(std::bit_cast<std::uint32_t>(p(axis)));
  }
}

// So many things of `bytes` each as there is room for, or none and the reader has failed.
std::size_t ReadCount(std::size_t bytes, ByteReader& in) {
  const std::uint32_t count = in.U32();
  if (count > in.remaining() / bytes) in.Fail();
  return in.ok() ? count : 0;
}

std::vector<Eigen::Vector3f> ReadPoints(ByteReader& in) {
  std::vector<Eigen::Vector3f> points(ReadCount(kPointBytes, in));
  for (Eigen::Vector3f& p : points) {
    for (int axis = 0; axis < 3; ++axis) p(axis) = std::bit_cast<float>(in.U32());
  }
  return points;
}

void WritePlace(const SubmapPlace& place, ByteWriter& out) {
  for (int axis = 0; axis < 3; ++axis) WriteDouble(place.ground(axis), out);
  for (const auto& band : place.profile.ranges) out.Raw(band);
}

SubmapPlace ReadPlace(ByteReader& in) {
  SubmapPlace place;
  for (int axis = 0; axis < 3; ++axis) place.ground(axis) = ReadDouble(in);
  for (auto& band : place.profile.ranges) {
    const ByteSpan ranges = in.Raw(band.size());
    std::copy(ranges.begin(), ranges.end(), band.begin());
  }
  return place;
}

}  // namespace

bool AreSubmap(ByteSpan bytes) {
  if (bytes.size() < sizeof(kMagic) + kChecksumBytes) return false;
  const ByteSpan content = bytes.first(bytes.size() - kChecksumBytes);
  return ByteReader(content).U32() == kMagic &&
         ByteReader(bytes.last(kChecksumBytes)).U64() == Hash64(content);
}

void WritePlaces(const std::vector<SubmapPlace>& places, ByteWriter& out) {
  out.U32(static_cast<std::uint32_t>(places.size()));
  for (const SubmapPlace& place : places) {
    WritePlace(place, out);
  }
}

std::vector<SubmapPlace> ReadPlaces(ByteReader& in) {
  std::vector<SubmapPlace> places(ReadCount(kPlaceBytes, in));
  for (SubmapPlace& place : places) {
    place = ReadPlace(in);
  }
  return in.ok() ? places : std::vector<SubmapPlace>();
}

Bytes Submap::Encode() const {
  ByteWriter out;
  out.U32(kMagic);
  WriteDouble(radius_m_, out);
  out.U32(static_cast<std::uint32_t>(blobs_.size()));
  for (const Bytes& blob : blobs_) {
    out.U32(static_cast<std::uint32_t>(blob.size()));
    out.Raw(blob);
  }
  for (const auto* points : {&features_.columns, &features_.ground, &features_.returns}) {
    WritePoints(*points, out);
  }
  WritePlaces(places_, out);
  out.U64(Hash64(out.bytes()));
  return out.Take();
}

Result<Submap> Submap::Decode(ByteSpan bytes) {
  const auto invalid = Error(StatusCode::kInvalidData, "submap: damaged or of another kind");
  if (!AreSubmap(bytes)) return invalid;
  ByteReader in(bytes.first(bytes.size() - kChecksumBytes).subspan(sizeof(kMagic)));
  Submap submap;
  submap.radius_m_ = ReadDouble(in);
  submap.blobs_.resize(ReadCount(4, in));
  for (Bytes& blob : submap.blobs_) {
    const ByteSpan tile = in.Raw(ReadCount(1, in));
    blob.assign(tile.begin(), tile.end());
  }
  for (auto* points :
       {&submap.features_.columns, &submap.features_.ground, &submap.features_.returns}) {
    *points = ReadPoints(in);
  }
  submap.places_ = ReadPlaces(in);
  if (!in.ok() || in.remaining() != 0) return invalid;
  return submap;
}

}  // namespace atlas

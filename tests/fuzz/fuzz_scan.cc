// Scan files and what a vehicle makes of them, up to the keyframe that it uploads.
#include <algorithm>
#include <bit>
#include <cmath>

#include "core/keyframe/keyframe_builder.h"
#include "core/keyframe/keyframe_codec.h"
#include "core/scan/scan_reader.h"
#include "tests/fuzz/support/fuzz_target.h"

namespace atlas::fuzz {
namespace {

constexpr std::size_t kPointBytes = 16;
constexpr int kChannels = 16;

float ElevationOf(int channel) {
  return 0.035F * static_cast<float>(channel) - 0.26F;
}

// Flat ground 1.8 m below the sensor and a wall around it.
Bytes GroundScan(int columns) {
  ByteWriter out;
  for (int channel = 0; channel < kChannels; ++channel) {
    for (int column = 0; column < columns; ++column) {
      const float azimuth = 6.2831853F * static_cast<float>(column) / static_cast<float>(columns);
      const float tangent = std::tan(ElevationOf(channel));
      const float range = tangent < -0.1F ? 1.8F / -tangent : 18.0F;
      for (const float value :
           {range * std::cos(azimuth), range * std::sin(azimuth), range * tangent, 0.5F}) {
        out.U32(std::bit_cast<std::uint32_t>(value));
      }
    }
  }
  return out.Take();
}

std::vector<Bytes> Seeds() {
  Bytes with_gaps = GroundScan(90);
  for (std::size_t i = 0; i + 3 < with_gaps.size(); i += 7 * kPointBytes) {
    std::fill_n(with_gaps.begin() + static_cast<std::ptrdiff_t>(i), 4, std::uint8_t{0xFF});  // NaN
  }
  return {GroundScan(24), GroundScan(90), with_gaps, Bytes(kPointBytes, 0)};
}

const KeyframeBuilder& Builder() {
  static const KeyframeBuilder kBuilder = [] {
    MapProfile map;
    map.cell_size_um = 500'000;
    SensorLayout layout;
    for (int channel = 0; channel < kChannels; ++channel) {
      layout.elevation_rad.push_back(ElevationOf(channel));
    }
    return KeyframeBuilder(map, layout, {});
  }();
  return kBuilder;
}

bool Run(ByteSpan bytes) {
  const auto cloud = ParseScan(bytes);
  if (!cloud) {
    return false;
  }
  for (const Eigen::Vector3f& p : cloud->points) {
    Require(p.allFinite(), "what is no return is dropped");
  }
  Require(cloud->size() > 0 && cloud->size() + cloud->dropped.size() == bytes.size() / kPointBytes,
          "every entry is a return or dropped");
  SensorLayoutEstimator estimator;
  estimator.Add(*cloud);
  const auto layout = estimator.Estimate();
  Require(!layout || layout->channels() <= 64, "a sensor has no more than 64 channels");
  const Keyframe keyframe = Builder().Build(*cloud, {});
  Require(ValidateKeyframe(keyframe).ok(), "whatever was scanned makes a keyframe");
  return true;
}

}  // namespace

const Target kTarget{&Seeds, &Run, &MutatePlain};

}  // namespace atlas::fuzz

// What scans said about one column segment, and whether that contradicts the map.
#pragma once

#include <cstdint>
#include <optional>

#include "core/localization/monitor/contradiction.h"

namespace atlas {

struct EvidenceOptions {
  // A scan that sees a segment measures something in it so often if something stands there, if
  // nothing does (it stands beside it then), and if nothing does but the map has structure beside
  // it.
  double hit_if_there = 0.6;
  double hit_if_not = 0.05;
  double hit_if_not_beside = 0.3;

  // Less is no contradiction, in logs of how much likelier what was seen is if it is one.
  // What vanished: and either half of it was passed so often.
  double min_vanished_score = 4.5;
  std::uint32_t min_half_passes = 3;
  // What appeared: it itself was hit in so many scans, and with the cells around it in enough.
  double min_appeared_score = 10.0;
  std::uint32_t min_appeared_hits = 2;
  // What moves: it was there, and since then it was not; meanwhile so few scans saw through it, for
  // each that it was there.
  double min_there_score = 4.0;
  double min_gone_score = 2.5;
  double max_flicker = 0.25;
  std::uint32_t min_driven_hits = 3;  // where the vehicle itself was, in the cells around it
};

// Halves of a segment, a bit each. A ray above a bollard says nothing about it (decision 0104).
inline constexpr std::uint8_t kLowerHalf = 1;
inline constexpr std::uint8_t kUpperHalf = 2;

// What one scan saw of a segment.
struct SegmentSight {
  bool is_hit = false;      // something was measured in it, or so near that it may be in it
  std::uint8_t passed = 0;  // halves that rays passed; none where it is hit
};

// What else is known of a place.
struct PlaceContext {
  bool is_driven = false;  // the vehicle itself was there, so that what else was there came or went
  bool is_beside_structure = false;
};

// Scans with hits and with passes.
struct EvidenceSum {
  std::uint32_t hits = 0;
  std::uint32_t passes = 0;

  EvidenceSum& operator+=(const EvidenceSum& other) {
    hits += other.hits;
    passes += other.passes;
    return *this;
  }
};

// Without cell and heights, which whoever keeps the evidence knows.
struct Verdict {
  ContradictionKind kind = ContradictionKind::kAppeared;
  std::uint32_t hits = 0;
  std::uint32_t passes = 0;
  std::uint32_t first_scan = 0;
  std::uint32_t last_scan = 0;
  double score = 0.0;
};

// Of a segment that the map says is occupied.
class OccupiedEvidence {
 public:
  // `halves`: those that have to be passed before it is free; the lower one may be ground.
  void Add(const SegmentSight& sight, std::uint8_t halves, std::uint32_t scan);
  std::optional<Verdict> Judge(std::uint8_t halves, const EvidenceOptions& options) const;

 private:
  std::uint32_t first_scan_ = 0;
  std::uint32_t last_scan_ = 0;
  std::uint16_t hits_ = 0;
  std::uint16_t lower_ = 0;  // scans in which the half was passed
  std::uint16_t upper_ = 0;
};

// Of a segment that the map says is free, and in which something was measured.
class FreeEvidence {
 public:
  // Once a scan, the hits before the passes.
  void AddHit(std::uint8_t halves, std::uint32_t scan);
  void AddPass(const SegmentSight& sight, std::uint32_t scan);
  EvidenceSum sum() const { return {hits_, passes_meanwhile_ + std::uint32_t{passes_since_}}; }
  // `around`: its own sum and that of the cells beside it.
  std::optional<Verdict> Judge(const EvidenceSum& around,
                               const PlaceContext& context,
                               const EvidenceOptions& options) const;

 private:
  std::uint32_t first_scan_ = 0;
  std::uint32_t last_scan_ = 0;
  std::uint32_t last_hit_ = 0;
  std::uint16_t hits_ = 0;
  std::uint16_t passes_meanwhile_ = 0;  // between the first hit and the last
  std::uint16_t passes_since_ = 0;      // after it
  std::uint8_t halves_ = 0;             // that were hit
};

}  // namespace atlas

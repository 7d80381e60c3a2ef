#include "core/fusion/tile_surveys.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <utility>

namespace atlas {
namespace {

// A stretch settles when its session went on with another one; when the tile was fused this often
// without it; or when this much time has gone by in the tile since it grew, a visit that is over,
// and the tile was fused a few times without it.
constexpr std::uint32_t kOpenFusions = 16;
constexpr std::int64_t kVisitMs = 60'000;
constexpr std::uint32_t kVisitFusions = 2;

}  // namespace

std::vector<FrameOnMap> TileSurveys::Expect(const TileChange& change,
                                            const FusionContext& context) {
  const MapProfile& profile = context.profile;
  assert(profile.preset != FusionPreset::kPaper);
  ++expected_count_;
  if (combined_.is_gone()) {
    combined_.Begin(id_, profile);
    touched_ = CellSet(combined_.tile().cell_begin.size() - 1);
    touched_.Fill();
  }
  Settle(profile);
  std::vector<PlannedStretch> wanted = Plan(change, profile);
  const std::vector<bool> is_staying = FindStaying(wanted);
  const auto is_leaving = [&](const TileStretch& stretch) {
    return !stretch.open && !is_staying[static_cast<std::size_t>(&stretch - stretches_.data())];
  };
  if (std::any_of(stretches_.begin(), stretches_.end(), is_leaving) &&
      settled_.PrepareToLose(is_staying, stretches_, profile)) {
    SurveyForgottenAgain(wanted);
  }
  TakeStretches(wanted, profile);
  const std::int64_t latest_ms = LatestTime();
  std::vector<FrameOnMap> expected;
  open_.clear();
  awaited_.clear();
  for (std::uint32_t i = 0; i < stretches_.size(); ++i) {
    TileStretch& stretch = stretches_[i];
    if (stretch.open) {
      open_.push_back(i);
    }
    if (stretch.grown_at == expected_count_) {
      stretch.tile_time_ms = latest_ms;
    }
    for (const StretchMember& frame : std::span(stretch.frames).subspan(wanted[i].kept)) {
      expected.push_back({{stretch.key, frame.sequence},
                          frame.time_ms,
                          frame.placement,
                          {profile.cell_size_um, frame.radius_cells},
                          frame.content});
      awaited_.push_back(i);
    }
  }
  std::reverse(awaited_.begin(), awaited_.end());
  return expected;
}

void TileSurveys::Add(const FrameOnMap& frame,
                      const Keyframe& keyframe,
                      const FusionContext& context) {
  stretches_[awaited_.back()].open->Add(frame, keyframe, context.sigmas);
  awaited_.pop_back();
}

std::vector<PlannedStretch> TileSurveys::Plan(const TileChange& change, const MapProfile& profile) {
  std::vector<PlannedStretch> plan;
  plan.reserve(stretches_.size() + 1);
  for (std::uint32_t i = 0; i < stretches_.size(); ++i) {
    TileStretch& stretch = stretches_[i];
    const std::size_t surveyed = stretch.frames.size();
    plan.push_back({stretch.key, stretch.number, std::move(stretch.frames), i, surveyed});
  }
  ApplyChange(change, id_, profile, plan);
  return plan;
}

// Which stretches stay as they are, by their places. One that grows and has forgotten some of its
// segments starts over.
std::vector<bool> TileSurveys::FindStaying(std::span<PlannedStretch> wanted) const {
  std::vector<bool> is_staying(stretches_.size());
  for (PlannedStretch& w : wanted) {
    if (w.old == PlannedStretch::kNone) {
      continue;
    }
    if (w.kept == w.frames.size()) {
      is_staying[w.old] = true;
    } else if (stretches_[w.old].has_forgotten) {
      w.StartOver();
    }
  }
  return is_staying;
}

void TileSurveys::SurveyForgottenAgain(std::span<PlannedStretch> wanted) const {
  for (PlannedStretch& w : wanted) {
    if (w.old != PlannedStretch::kNone && stretches_[w.old].has_forgotten) {
      w.StartOver();
    }
  }
}

void TileSurveys::TakeStretches(std::span<PlannedStretch> wanted, const MapProfile& profile) {
  const TileBand whole{id_, 0, profile.tile_cells};
  std::vector<std::uint32_t> settled_places(stretches_.size(), SettledStretches::kGone);
  std::vector<TileStretch> next;
  for (std::uint32_t i = 0; i < wanted.size(); ++i) {
    PlannedStretch& w = wanted[i];
    const bool grows = w.kept < w.frames.size();
    TileStretch stretch{std::move(w.key), w.number, 0, 0, {}, {}, {}, false, 0, 0, 0};
    if (w.old == PlannedStretch::kNone) {
      stretch.vehicle = NumberOf(stretch.key.vehicle);
      stretch.open.emplace(whole, profile);
    } else {
      stretch = std::move(stretches_[w.old]);
      stretches_[w.old].open.reset();
      const bool reopens = !stretch.open && grows;
      if (reopens) {
        stretch.open = Reopen(w.old, std::span(w.frames).first(w.kept), profile);
      }
      settled_places[w.old] = reopens ? SettledStretches::kGone : i;
    }
    stretch.session = 0;
    if (!next.empty()) {
      stretch.session = next.back().session + (next.back().key == stretch.key ? 0u : 1u);
    }
    stretch.frames = std::move(w.frames);
    stretch.times_ms.clear();
    for (const StretchMember& frame : stretch.frames) {
      stretch.times_ms.push_back(frame.time_ms);
    }
    stretch.grown_at = grows ? expected_count_ : stretch.grown_at;
    next.push_back(std::move(stretch));
  }
  for (const TileStretch& dropped : stretches_) {
    if (dropped.open) {
      dropped.open->FindCells(touched_);
    }
  }
  settled_.Renumber(settled_places, touched_);
  stretches_ = std::move(next);
}

std::uint32_t TileSurveys::NumberOf(const std::string& vehicle) {
  const auto its = std::find(vehicles_.begin(), vehicles_.end(), vehicle);
  const auto number = static_cast<std::uint32_t>(its - vehicles_.begin());
  if (its == vehicles_.end()) {
    vehicles_.push_back(vehicle);
  }
  return number;
}

StretchSurvey TileSurveys::Reopen(std::uint32_t place,
                                  std::span<const StretchMember> frames,
                                  const MapProfile& profile) const {
  StretchSurvey survey({id_, 0, profile.tile_cells}, profile);
  for (const StretchMember& frame : frames) {
    survey.AddFrame({frame.sequence, frame.time_ms});
  }
  settled_.CopyTo(place, survey);
  return survey;
}

// Of the last keyframes of all stretches.
std::int64_t TileSurveys::LatestTime() const {
  std::int64_t latest_ms = std::numeric_limits<std::int64_t>::min();
  for (const TileStretch& stretch : stretches_) {
    latest_ms = std::max(latest_ms, stretch.frames.back().time_ms);
  }
  return latest_ms;
}

bool TileSurveys::IsToSettle(std::size_t place, std::int64_t latest_ms) const {
  const TileStretch& stretch = stretches_[place];
  const std::uint32_t idle = expected_count_ - stretch.grown_at;
  if (!stretch.open || idle == 0) {
    return false;
  }
  const std::size_t next = place + 1;
  const bool session_goes_on = next < stretches_.size() && stretches_[next].key == stretch.key;
  const bool is_over = stretch.tile_time_ms < latest_ms - kVisitMs;
  return session_goes_on || idle > kOpenFusions || (is_over && idle > kVisitFusions);
}

void TileSurveys::Settle(const MapProfile& profile) {
  const std::int64_t latest_ms = LatestTime();
  std::vector<std::uint32_t> settling;
  for (std::uint32_t i = 0; i < stretches_.size(); ++i) {
    if (IsToSettle(i, latest_ms)) {
      settling.push_back(i);
    }
  }
  if (!settling.empty()) {
    settled_.Settle(settling, stretches_, profile);
  }
}

const Tile& TileSurveys::Combine(const FusionContext& context) {
  assert(awaited_.empty());
  combined_.Update(touched_, {settled_, stretches_, open_}, context);
  touched_.Clear();
  return combined_.tile();
}

std::size_t TileSurveys::bytes() const {
  std::size_t bytes = sizeof(*this) + settled_.bytes() + combined_.bytes();
  for (const TileStretch& stretch : stretches_) {
    bytes += stretch.bytes();
  }
  for (const std::string& vehicle : vehicles_) {
    bytes += sizeof(std::string) + vehicle.capacity();
  }
  return bytes;
}

std::size_t TileSurveys::ExpectedBytes(const MapProfile& profile) const {
  constexpr std::size_t kCellBytes = 128;  // a segment or two of each stretch
  std::size_t growing = 0;
  for (std::size_t i = 0; i < awaited_.size(); ++i) {
    growing += i == 0 || awaited_[i] != awaited_[i - 1] ? 1u : 0u;
  }
  return bytes() + growing * profile.tile_cells * profile.tile_cells * kCellBytes;
}

// Repeated calls of either do nothing.
void TileSurveys::Pack() {
  if (is_packed_) {
    return;
  }
  is_packed_ = true;
  settled_.Pack();
  for (TileStretch& stretch : stretches_) {
    stretch.used = 0;
    if (stretch.open) {
      stretch.open->Pack();
    }
  }
  combined_.Clear();
}

void TileSurveys::Unpack() {
  if (!is_packed_) {
    return;
  }
  is_packed_ = false;
  settled_.Unpack();
  for (TileStretch& stretch : stretches_) {
    if (stretch.open) {
      stretch.open->Unpack();
    }
  }
}

Bytes TileSurveys::Save() const {
  ByteWriter out;
  out.Varint(expected_count_);
  out.Varint(vehicles_.size());
  for (const std::string& vehicle : vehicles_) {
    out.String(vehicle);
  }
  settled_.Save(out);
  out.Varint(stretches_.size());
  for (const TileStretch& stretch : stretches_) {
    stretch.Save(out);
  }
  return out.Take();
}

Result<TileSurveys> TileSurveys::Load(ByteSpan bytes, const TileId& id, const MapProfile& profile) {
  ByteReader in(bytes);
  TileSurveys surveys(id);
  surveys.is_packed_ = true;
  surveys.expected_count_ = static_cast<std::uint32_t>(in.Varint());
  const std::uint64_t vehicles = in.Varint();
  for (std::uint64_t i = 0; i < vehicles && in.ok(); ++i) {
    surveys.vehicles_.emplace_back(in.String(kMaxNameSize));
  }
  surveys.settled_ = SettledStretches::Load(in);
  const std::uint64_t count = in.Varint();
  for (std::uint64_t i = 0; i < count && in.ok(); ++i) {
    surveys.stretches_.push_back(TileStretch::Load(in, id, profile));
  }
  if (!in.ok() || in.remaining() != 0) {
    return Error(StatusCode::kInvalidData, "surveys: cut or damaged");
  }
  return surveys;
}

}  // namespace atlas

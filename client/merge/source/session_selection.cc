#include "client/merge/source/session_selection.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "core/base/hash.h"
#include "core/base/str_cat.h"
#include "core/keyframe/keyframe_codec.h"

namespace atlas {
namespace {

constexpr double kMicrometre = 1e-6;

// Empty: it is merged.
std::string WhyNot(const SessionSummary& session, const std::vector<SessionKey>& wanted) {
  if (session.is_damaged) return StrCat("damaged: ", session.reason);
  if (!session.IsInMap() && session.state != "staged") return session.state;
  if (session.keyframes == 0) return "no keyframe";
  const bool is_wanted = wanted.empty() || session.IsInMap() ||
                         std::find(wanted.begin(), wanted.end(), session.key) != wanted.end();
  return is_wanted ? "" : "not asked for";
}

Status CheckWanted(const std::vector<SessionKey>& wanted,
                   const std::vector<SessionSummary>& sessions) {
  for (const SessionKey& key : wanted) {
    const bool is_there = std::any_of(sessions.begin(), sessions.end(),
                                      [&](const auto& session) { return session.key == key; });
    if (!is_there) return {StatusCode::kNotFound, StrCat("there is no session ", key)};
  }
  return {};
}

std::optional<KeyframePrior> PriorOf(const SessionKeyframe& keyframe) {
  if (!keyframe.prior || keyframe.prior->radius_mm == 0) {
    return std::nullopt;
  }
  const KnownPosition& prior = *keyframe.prior;
  return KeyframePrior{kMicrometre * Eigen::Vector3d(static_cast<double>(prior.x_um),
                                                     static_cast<double>(prior.y_um),
                                                     static_cast<double>(prior.z_um)),
                       1e-3 * prior.radius_mm};
}

// Empty: it can be merged.
std::string DamageOf(const SessionKeyframe& keyframe, const MapProfile& profile) {
  if (!keyframe.damage.empty()) return keyframe.damage;
  const auto header = CheckKeyframe(keyframe.blob);
  if (!header) return header.error().message();
  return CheckKeyframeProfile(*header, profile).message();
}

class Reading {
 public:
  Reading(SessionSource& source, KeyframeSpool& spool) : source_(source), spool_(spool) {}

  // Calls on_keyframe before each. Nothing is added where no keyframe is whole.
  Status Add(const SessionSummary& summary, const std::function<Status()>& on_keyframe) {
    MergeSession session;
    session.key = summary.key;
    session.is_staged = !summary.IsInMap();
    std::vector<Spooled> spooled;
    const auto reading =
        source_.ReadKeyframes(summary.key, [&](SessionKeyframe keyframe) -> Status {
          ATLAS_RETURN_IF_ERROR(on_keyframe());
          if (const std::string damage = DamageOf(keyframe, source_.profile()); !damage.empty()) {
            read_.left_out.push_back(
                {summary.key, StrCat("keyframe ", keyframe.sequence, ": ", damage)});
            return {};
          }
          const auto number = spool_.Add(keyframe.blob);
          if (!number) return number.error();
          spooled.push_back({{keyframe.sequence, keyframe.time_ms, keyframe.T_world_sensor,
                              PriorOf(keyframe), Hash64(keyframe.blob)},
                             *number});
          return {};
        });
    if (!reading) return reading.error();
    NoteRevision(reading->revision);
    if (spooled.empty()) {
      read_.left_out.push_back({summary.key, "no keyframe that is whole"});
      return {};
    }
    std::sort(spooled.begin(), spooled.end(), [](const Spooled& a, const Spooled& b) {
      return a.keyframe.sequence < b.keyframe.sequence;
    });
    auto numbers = std::make_shared<std::vector<std::size_t>>();
    for (const Spooled& one : spooled) {
      session.keyframes.push_back(one.keyframe);
      numbers->push_back(one.number);
    }
    read_.sessions.push_back(std::move(session));
    read_.readers.emplace_back(
        [this_spool = &spool_, numbers](std::size_t i) { return this_spool->Read((*numbers)[i]); });
    return {};
  }

  void LeaveOut(const SessionKey& key, std::string why) {
    read_.left_out.push_back({key, std::move(why)});
  }

  ReadSessions Take() { return std::move(read_); }

 private:
  struct Spooled {
    MergeKeyframe keyframe;
    std::size_t number;
  };

  // All of it holds since the first of them; what has none is of another atlas.
  void NoteRevision(std::uint64_t revision) {
    if (revision == 0) return;
    read_.revision = read_.revision == 0 ? revision : std::min(read_.revision, revision);
  }

  SessionSource& source_;
  KeyframeSpool& spool_;
  ReadSessions read_;
};

}  // namespace

Result<ReadSessions> ReadForMerge(
    SessionSource& source,
    const std::vector<SessionKey>& wanted,
    KeyframeSpool& spool,
    const std::function<Status(std::size_t done, std::size_t all)>& progress) {
  auto sessions = source.ListSessions();
  if (!sessions) return Error(sessions.error());
  if (Status status = CheckWanted(wanted, *sessions); !status.ok()) return Error(std::move(status));
  std::stable_sort(
      sessions->begin(), sessions->end(),
      [](const SessionSummary& a, const SessionSummary& b) { return a.IsInMap() > b.IsInMap(); });
  std::size_t all = 0;
  for (const SessionSummary& session : *sessions) {
    all += WhyNot(session, wanted).empty() ? session.keyframes : 0;
  }
  std::size_t done = 0;
  Reading reading(source, spool);
  for (const SessionSummary& session : *sessions) {
    if (std::string why = WhyNot(session, wanted); !why.empty()) {
      reading.LeaveOut(session.key, std::move(why));
      continue;
    }
    Status status = reading.Add(session, [&]() -> Status {
      done = std::min(done + 1, all);  // more may come meanwhile
      return progress ? progress(done, all) : Status();
    });
    if (!status.ok()) return Error(std::move(status));
  }
  return reading.Take();
}

}  // namespace atlas

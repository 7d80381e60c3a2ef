#include "server/service/fusion/tile_refresher.h"

#include <algorithm>
#include <chrono>
#include <tuple>
#include <utility>

#include "server/service/fusion/stored_keyframes.h"

namespace atlas {
namespace {

Status Stopping() {
  return {StatusCode::kUnavailable, "the daemon stops"};
}

class StopGrace {
 public:
  StopGrace(const std::stop_token& stop, std::chrono::milliseconds length)
      : stop_(stop), length_(length) {}

  // kUnavailable when it is over.
  Status Check() {
    if (!stop_.stop_requested()) {
      return {};
    }
    const auto now = Clock::now();
    until_ = std::min(until_, now + length_);
    return now < until_ ? Status() : Stopping();
  }

 private:
  using Clock = std::chrono::steady_clock;

  const std::stop_token& stop_;
  const std::chrono::milliseconds length_;
  Clock::time_point until_ = Clock::time_point::max();
};

}  // namespace

TileRefresher::TileRefresher(AtlasStore& store,
                             const TileRefresherOptions& options,
                             const LogSink& log)
    : store_(store),
      profile_(store.identity().profile),
      sigmas_(profile_, Keyframe::kMaxRadiusCells),
      group_bytes_(options.group_bytes),
      alone_bytes_(std::max(options.group_bytes, options.surveys.plain_bytes)),
      stop_grace_(options.stop_grace),
      keyframes_(options.keyframe_bytes),
      tiles_(options.tile_bytes),
      survey_files_(
          options.survey_files, profile_, [&store] { return store.ReadLine(); }, log),
      surveys_(options.surveys, survey_files_),
      builder_(store, keyframes_, tiles_, options.group_bytes) {}

bool TileRefresher::StoreIdle() {
  survey_files_.MakeRoom();
  return survey_files_.is_on() && surveys_.StoreIdle();
}

std::size_t TileRefresher::MoveToDisk() {
  return survey_files_.is_on() ? surveys_.MoveToDisk() : 0;
}

void TileRefresher::Build(std::span<const TileId> ids,
                          const std::stop_token& stop,
                          const OnBuilt& on_built) {
  std::vector<Job> jobs;
  std::size_t bytes = 0;
  StopGrace grace(stop, stop_grace_);
  const auto check_stop = [&grace] {
    return grace.Check();
  };
  for (const TileId& id : ids) {
    if (stop.stop_requested()) {
      on_built(id, Error(Stopping()));
      continue;
    }
    if (id.level > 0 || profile_.preset == FusionPreset::kPaper) {
      on_built(id, builder_.Build(id, check_stop));
      continue;
    }
    Result<Job> job = Prepare(id);
    if (!job) {
      on_built(id, Error(job.error()));
      continue;
    }
    const std::size_t job_bytes = job->surveys.ExpectedBytes(profile_);
    if (job_bytes > alone_bytes_) {
      job->surveys = TileSurveys(id);  // not beside what is built
      on_built(id, builder_.Build(id, check_stop));
      continue;
    }
    if (bytes + job_bytes > group_bytes_) {
      Run(jobs, check_stop, on_built);
      jobs.clear();
      bytes = 0;
    }
    jobs.push_back(*std::move(job));
    bytes += job_bytes;
  }
  Run(jobs, check_stop, on_built);
}

// With the surveys of the last time, where they are still there. They are taken out meanwhile: what
// fails is lost, and two workers never share.
Result<TileRefresher::Job> TileRefresher::Prepare(const TileId& id) {
  std::optional<KeptSurveys> kept = surveys_.Take(id);
  Job job{kept ? std::move(kept->surveys) : TileSurveys(id), kept ? kept->revision : 0, {}, {}};
  const auto sources = store_.GatherTile(id, job.revision);
  if (!sources) {
    return Error(sources.error());
  }
  if (sources->is_whole && job.revision != 0) {
    job.surveys = TileSurveys(id);
  }
  auto frames = PlaceKeyframes(sources->keyframes);
  if (!frames) {
    return Error(frames.error());
  }
  TileChange change{*std::move(frames), {}};
  for (const std::int64_t keyframe : sources->gone) {
    change.absent.push_back(static_cast<std::uint64_t>(keyframe));
  }
  job.revision = sources->revision;
  job.expected = job.surveys.Expect(change, context());
  return job;
}

void TileRefresher::Run(std::vector<Job>& jobs,
                        const TileBuilder::CheckStop& check_stop,
                        const OnBuilt& on_built) {
  AddKeyframes(jobs, check_stop);
  for (Job& job : jobs) {
    const TileId id = job.surveys.id();
    if (job.status.ok()) {
      job.status = check_stop();
    }
    if (!job.status.ok()) {
      on_built(id, Error(std::move(job.status)));
      continue;
    }
    const Tile& tile = job.surveys.Combine(context());
    auto content = ToContent(tile, profile_);
    if (content) {
      tiles_.Insert(content->payload_hash, std::make_shared<const Tile>(tile));
    }
    surveys_.Put({std::move(job.surveys), job.revision});
    on_built(id, BuiltTile{job.revision, std::move(content)});
  }
  surveys_.Trim();  // which may wait for the disk: nobody waits for it
}

// In canonical order, which is that of each job.
void TileRefresher::AddKeyframes(std::vector<Job>& jobs, const TileBuilder::CheckStop& check_stop) {
  struct Use {
    const FrameOnMap* frame = nullptr;
    Job* job = nullptr;
  };
  std::vector<Use> uses;
  for (Job& job : jobs) {
    for (const FrameOnMap& frame : job.expected) {
      uses.push_back({&frame, &job});
    }
  }
  std::stable_sort(uses.begin(), uses.end(),
                   [](const Use& a, const Use& b) { return a.frame->key < b.frame->key; });
  std::uint64_t content = 0;
  Result<KeyframeCache::Handle> keyframe = KeyframeCache::Handle();
  for (const Use& use : uses) {
    if (!use.job->status.ok()) {
      continue;
    }
    if (Status status = check_stop(); !status.ok()) {
      use.job->status = std::move(status);
      continue;
    }
    if (*keyframe == nullptr || use.frame->content != content) {
      content = use.frame->content;
      keyframe = ReadKeyframe(*use.frame, store_, keyframes_);
    }
    if (!keyframe) {
      use.job->status = keyframe.error();
      keyframe = KeyframeCache::Handle();
    } else {
      use.job->surveys.Add(*use.frame, **keyframe, context());
    }
  }
}

}  // namespace atlas

#include "client/cli/commands/merge/serve_events.h"

#include <algorithm>
#include <vector>

#include <boost/json/array.hpp>

#include "client/cli/commands/merge/merge_json.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr std::size_t kNamed = 5;  // sessions in a sentence; all are in the fields

std::string NamesOf(const std::vector<SessionKey>& sessions) {
  std::string names;
  for (std::size_t i = 0; i < std::min(sessions.size(), kNamed); ++i) {
    names += StrCat(i == 0 ? "" : ", ", sessions[i]);
  }
  if (sessions.size() > kNamed) names += StrCat(" and ", sessions.size() - kNamed, " more");
  return names.empty() ? "none" : names;
}

std::string WhatOf(const std::vector<LimitBreach>& breaches) {
  std::string what;
  for (std::size_t i = 0; i < std::min(breaches.size(), kNamed); ++i) {
    what += (i == 0 ? "" : "; ") + breaches[i].what;
  }
  if (breaches.size() > kNamed) what += StrCat("; and ", breaches.size() - kNamed, " more");
  return what;
}

boost::json::array NamesJson(const std::vector<SessionKey>& sessions) {
  boost::json::array names;
  for (const SessionKey& key : sessions) {
    names.emplace_back(StrCat(key));
  }
  return names;
}

boost::json::object FieldsOf(const char* event, const std::vector<SessionKey>& sessions) {
  return {{"event", event}, {"sessions", NamesJson(sessions)}};
}

// Of a merge, why each one of `sessions` stays where it is.
std::string WhyOf(const MergeRun& run, const std::vector<SessionKey>& sessions) {
  std::string why;
  const auto add = [&](const SessionKey& key, const std::string& what) {
    if (std::find(sessions.begin(), sessions.end(), key) == sessions.end()) return;
    why += StrCat(why.empty() ? "" : "; ", key, " ", what);
  };
  for (std::size_t i = 0; i < run.sessions.size(); ++i) {
    if (!run.plan.sessions[i].is_joined) add(run.sessions[i].key, run.plan.sessions[i].why_not);
  }
  for (const LeftOut& left_out : run.left_out) {
    add(left_out.key, "left out, " + left_out.why);
  }
  return why;
}

}  // namespace

void ServeEvents::Note(const MergeEvent& event) {
  switch (event.kind) {
    case MergeEventKind::kConnected:
      log_.Line(ServeLogLevel::kInfo, "watches " + daemon_,
                {{"event", "connected"}, {"daemon", daemon_}});
      return;
    case MergeEventKind::kLost:
      log_.Line(
          ServeLogLevel::kWarning,
          StrCat("lost ", daemon_, ", tries again: ", event.status.message()),
          {{"event", "lost"}, {"daemon", daemon_}, {"code", StatusCodeName(event.status.code())}});
      return;
    case MergeEventKind::kBegun:
      log_.Line(ServeLogLevel::kInfo, "merges " + NamesOf(event.sessions),
                FieldsOf("begun", event.sessions));
      return;
    case MergeEventKind::kGoesOn:
      log_.Line(
          ServeLogLevel::kInfo, StrCat(event.step, ": ", event.done, " of ", event.all),
          {{"event", "goes_on"}, {"step", event.step}, {"done", event.done}, {"all", event.all}});
      return;
    default:
      NoteMerge(event);
  }
}

void ServeEvents::NoteRefused(const MergeEvent& event) {
  for (const UnmergedSession& one : UnmergedOf(*event.run, event.sessions)) {
    if (one.is_waiting || !refused_.ok()) continue;
    refused_ = {StatusCode::kInvalidData, StrCat(one.key, " stays staged: ", one.why)};
  }
}

// What became of one.
void ServeEvents::NoteMerge(const MergeEvent& event) {
  const std::string names = NamesOf(event.sessions);
  const auto failed = [&](ServeLogLevel level, const char* name, const std::string& sentence) {
    boost::json::object fields = FieldsOf(name, event.sessions);
    fields["code"] = StatusCodeName(event.status.code());
    log_.Line(level, StrCat(sentence, event.status.message()), fields);
  };
  if (event.run != nullptr && event.kind != MergeEventKind::kOverLimits) NoteRefused(event);
  if (event.kind == MergeEventKind::kApplied) {
    NoteApplied(event);
  } else if (event.kind == MergeEventKind::kOverLimits) {
    NoteOverLimits(event);
  } else if (event.kind == MergeEventKind::kNothing) {
    log_.Line(ServeLogLevel::kInfo, "nothing to apply: " + WhyOf(*event.run, event.sessions),
              FieldsOf("nothing", event.sessions));
  } else if (event.kind == MergeEventKind::kFailed) {
    failed(ServeLogLevel::kError, "failed", names + " cannot be merged, stays staged: ");
  } else if (event.kind == MergeEventKind::kPutOff) {
    failed(ServeLogLevel::kWarning, "put_off", "put off, tries again: ");
  } else {
    const std::string why =
        event.breaches.empty() ? event.status.message() : WhatOf(event.breaches);
    log_.Line(ServeLogLevel::kWarning, StrCat("tries in parts what is not applied at once: ", why),
              FieldsOf("split", event.sessions));
  }
}

void ServeEvents::NoteApplied(const MergeEvent& event) {
  const std::vector<SessionKey> published = event.run->Published();
  boost::json::object fields = FieldsOf("applied", event.sessions);
  fields["published"] = NamesJson(published);
  fields["batch"] = event.batch->batch;
  fields["revision"] = event.batch->revision;
  fields["updated"] = event.batch->updated;
  fields["tiles_marked"] = event.batch->tiles_marked;
  Report(StrCat("batch-", event.batch->batch), event, false, fields);
  log_.Line(ServeLogLevel::kInfo,
            StrCat("batch ", event.batch->batch, ": published ", NamesOf(published), "; ",
                   event.batch->updated, " poses corrected, ", event.batch->tiles_marked,
                   " tiles marked"),
            fields);
  for (const SessionEntry& entry : event.batch->sessions) {
    if (entry.state != "quarantined") continue;
    log_.Line(ServeLogLevel::kWarning,
              StrCat("session ", entry.key, " is quarantined, not in the map: ", entry.reason),
              FieldsOf("quarantined", {entry.key}));
  }
  if (const std::string why = WhyOf(*event.run, event.sessions); !why.empty()) {
    log_.Line(ServeLogLevel::kInfo, "stay staged: " + why, FieldsOf("nothing", event.sessions));
  }
}

void ServeEvents::NoteOverLimits(const MergeEvent& event) {
  boost::json::object fields = FieldsOf("over_limits", event.sessions);
  Report("over-limits", event, true, fields);
  log_.Line(ServeLogLevel::kWarning,
            StrCat("not applied, over limits: ", WhatOf(event.breaches),
                   "; by hand: ", "atlas-merge run --session ", event.sessions.front()),
            fields);
}

void ServeEvents::Report(const std::string& fate,
                         const MergeEvent& event,
                         bool with_corrections,
                         boost::json::object& fields) {
  if (!reports_) return;
  boost::json::object json = MergeJson(*event.run, event.batch);
  json["time"] = NowText();
  json["asked_for"] = NamesJson(event.sessions);
  boost::json::array breaches;
  for (const LimitBreach& breach : event.breaches) {
    breaches.emplace_back(breach.what);
  }
  json["over_limits"] = std::move(breaches);
  const auto file = reports_->Write(fate, *event.run, json, with_corrections);
  if (file) {
    fields["report"] = file->string();
    return;
  }
  log_.Line(ServeLogLevel::kWarning, "there is no report: " + file.error().message(),
            {{"event", "no_report"}, {"code", StatusCodeName(file.error().code())}});
}

}  // namespace atlas

// Whether a vehicle is known to be where it is tracked. A place that was found after it was lost,
// or far from where it was expected, may be another that looks like it: one deck of a garage off it
// fits for as long as the drive goes on. It is confirmed by scans that follow, each of them
// registered on the decks above and below, too.
#pragma once

#include <optional>
#include <vector>

#include "core/localization/other_decks.h"
#include "core/localization/pose_prior.h"
#include "core/localization/registration.h"

namespace atlas {

struct ConfirmationOptions {
  DeckOptions decks;

  // A scan speaks for a place when it fits as well as is asked, when this share of its columns
  // stands on structure there and so much of it is explained ...
  double min_columns = 0.1;
  double min_explained = 0.04;
  // ... and it is confirmed by so many in a row that fit as usual on this drive, or this well, or
  // by more that fit well enough.
  double usual_share = 0.85;
  double usual_fit = 0.6;
  double good_fit = 0.45;
  int usual_scans = 3;
  int good_scans = 20;
  // On average of the scans, fit and what is explained are together so much more than on any other
  // deck. Along simulated drives through a garage of four decks other decks were ahead by 0.04 at
  // most, of single scans on ramps; the median was 0.2 behind.
  double min_margin = 0.08;
  double taken_margin = 0.12;  // of another deck, which takes the vehicle over

  int compared_after = 25;  // scans, where nothing is in doubt

  // How far off a place may be that is not confirmed, standard deviations.
  double sigma_m = 10.0;
  double sigma_up_m = 5.0;
  double sigma_rad = 0.5;
};

class Confirmation {
 public:
  Confirmation(const ConfirmationOptions& options, const RegistrationOptions& registration)
      : options_(options), registration_(registration) {}

  bool is_confirmed() const { return is_confirmed_; }
  // The place is known: it was told.
  void Trust();
  // The place is a new one: nothing has spoken for it.
  void Doubt();
  // The scan fits nothing here.
  void Miss();
  // Who looked for it anywhere found it here, too.
  void Agree() { usual_scans_ = options_.usual_scans; }

  // Whether the scan fits as usual and as much of it as is asked is explained. `usual_fit`: of this
  // drive, 0 where none is known.
  bool IsAsUsual(const RegistrationResult& here,
                 const ScanFeatures& features,
                 double usual_fit) const;
  // Whether the scan speaks for a place that is not confirmed at all.
  bool IsEnough(const RegistrationResult& here, const ScanFeatures& features) const;

  // The scan was registered `here`. While that is confirmed it is compared with other decks now and
  // then, and at once where it `is_doubtful`; one that is better puts it in doubt. In doubt, it
  // counts for confirmation; or the registration on another deck comes back, where the vehicle is
  // rather: in doubt there, too.
  std::optional<RegistrationResult> Weigh(const MapWindow& map,
                                          const ScanFeatures& features,
                                          const RegistrationResult& here,
                                          double usual_fit,
                                          bool is_doubtful);

  // What is to be added to the covariance of a place that is not confirmed.
  PoseCovariance Spread() const;

 private:
  // Another deck, and what scans said of it.
  struct Rival {
    double up_m = 0.0;
    double lead = 0.0;  // sum of how much better each scan fits here
    int scans = 0;
    RegistrationResult registration;  // of the last scan

    double margin() const { return lead / scans; }
  };

  // Renews rivals_.
  void Compare(const MapWindow& map, const ScanFeatures& features, const RegistrationResult& here);
  bool IsAhead() const;  // of all rivals
  void Count(bool is_good, bool is_usual);

  ConfirmationOptions options_;
  RegistrationOptions registration_;
  bool is_confirmed_ = true;
  int usual_scans_ = 0;  // in a row that spoke for the place
  int good_scans_ = 0;
  int uncompared_ = 0;  // scans, while it is confirmed
  std::vector<Rival> rivals_;
};

// Share of the scan's columns that the map explains there, less contradictions.
double ExplainedShare(const RegistrationResult& registration, const ScanFeatures& features);

}  // namespace atlas

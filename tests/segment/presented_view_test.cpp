// SPDX-License-Identifier: Apache-2.0
// The view that one viewer of a run presents to the others.
#include "shared/segment/presented_view.hpp"

#include <cmath>
#include <fstream>
#include <limits>
#include <memory>
#include <string>

#include <doctest/doctest.h>
#include <rapidcheck.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/support/temporary_folder.hpp"

namespace kerf::presented_view_test {

using kerf::test::RuntimeFolder;

namespace {

PresentedView from(double x) {
  return {{x, 20, 30}, {1, 2, 3}, {0, 1, 0}};
}

}  // namespace

TEST_CASE("a follower has the presenter's newest view, and the last one once that has gone") {
  const RuntimeFolder folder;
  ViewFollower follower("run");
  follower.poll();
  CHECK_FALSE(follower.presented());
  CHECK(follower.count() == 0);
  {
    ViewPresenter presenter("run");
    follower.poll();
    CHECK_FALSE(follower.presented());  // it has shown none yet
    presenter.show(from(1));
    follower.poll();
    CHECK(follower.presented());
    CHECK(follower.presenter() == static_cast<std::uint64_t>(getpid()));
    CHECK(follower.view() == from(1));
    presenter.show(from(1));
    follower.poll();
    CHECK(follower.count() == 1);
    presenter.show(from(2));
    presenter.show(from(3));
    follower.poll();
    CHECK(follower.count() == 2);
    CHECK(follower.view() == from(3));
  }
  follower.poll();
  CHECK_FALSE(follower.presented());
  CHECK(follower.view() == from(3));
  ViewPresenter next("run");
  next.show(from(4));
  follower.poll();
  CHECK(follower.presented());
  CHECK(follower.view() == from(4));
}

TEST_CASE("one presents: the second is refused by name and way out, until the first has gone") {
  const RuntimeFolder folder;
  auto first = std::make_unique<ViewPresenter>("run");
  first->show(from(1));
  CHECK_THROWS_WITH_AS(
      ViewPresenter("run"),
      ("--present: process " + std::to_string(getpid()) +
       " presents the views of \"run\" already; end it, or follow it with --follow-view")
          .c_str(),
      SegmentError);
  const ViewPresenter of_another_run("other");
  first.reset();
  const ViewPresenter second("run");
}

TEST_CASE("a presenter that is killed has gone, and another one takes its place") {
  const RuntimeFolder folder;
  int ready[2];
  REQUIRE(pipe(ready) == 0);
  const pid_t child = fork();
  if (child == 0) {
    ViewPresenter presenter("run");
    presenter.show(from(7));
    static_cast<void>(write(ready[1], "x", 1) == 1);
    for (;;) pause();
  }
  char byte = 0;
  REQUIRE(read(ready[0], &byte, 1) == 1);
  ViewFollower follower("run");
  follower.poll();
  CHECK(follower.presented());
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  follower.poll();
  CHECK_FALSE(follower.presented());
  CHECK(follower.view() == from(7));
  ViewPresenter next("run");
  follower.poll();
  CHECK_FALSE(follower.presented());  // what the killed one left is no view of this one
  next.show(from(8));
  follower.poll();
  CHECK(follower.view() == from(8));
  close(ready[0]);
  close(ready[1]);
}

TEST_CASE("a view that is none is neither shown nor taken") {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const RuntimeFolder folder;
  ViewPresenter presenter("run");
  presenter.show(from(1));
  for (const PresentedView& wrong : {from(kNan), from(std::numeric_limits<double>::infinity()),
                                     from(1.1e5), PresentedView{{1, 2, 3}, {1, 2, 3}, {0, 1, 0}},
                                     PresentedView{{0, 9, 0}, {0, 0, 0}, {0, -2, 0}},
                                     PresentedView{{0, 9, 0}, {0, 0, 0}, {0, 0, 0}},
                                     PresentedView{{0, 9, 0}, {0, 0, 0}, {1e-7, 1, 0}}}) {
    CHECK_FALSE(is_valid(wrong));
    presenter.show(wrong);
  }
  CHECK(is_valid({{0, 9, 0}, {0, 0, 0}, {1, 1, 0}}));
  ViewFollower follower("run");
  follower.poll();
  CHECK(follower.view() == from(1));
  CHECK_THROWS_AS(ViewFollower("a/b"), SegmentError);
  CHECK(rc::check([&](const std::string& bytes) {  // whatever else of this user writes there
    std::ofstream(folder / "kerf" / "run.view", std::ios::binary) << bytes;
    follower.poll();
    RC_ASSERT(follower.view() == from(1));
  }));
}

}  // namespace kerf::presented_view_test

//! The list of runs, by keys and mouse.

use super::*;
use crate::tui::view::{Grouping, RunSummary};

#[test]
fn the_selected_run_stays_selected_when_others_are_added() {
    let (mut app, _) = app(typical());
    press(&mut app, "5 down");
    let (mut other, asked) = super::app({
        let mut view = typical();
        view.runs.push(Arc::new(crate::tui::testing::run_summary("new")));
        view
    });
    other.screens.runs = std::mem::take(&mut app.screens.runs);
    other.tab = Tab::Runs;
    press(&mut other, "C");
    assert_eq!(*asked.borrow(), ["continue runs/old"]);
}

#[test]
fn runs_are_watched_filtered_continued_and_evaluated() {
    check(typical(), "5 down enter", &["open runs/old"], "");
    check(typical(), "5 down C", &["continue runs/old"], "");
    check(typical(), "5 v", &["evaluate"], "");
    check(typical(), "5 down v", &["open runs/old", "evaluate"], "");
    check(typical(), "5 down : e v a l u a t e enter", &["open runs/old", "evaluate"], "");
    check(grouped(), "5 : t r a i n space n e w enter enter", &["train new", "open runs/guided-0"], "");
    check(typical(), "5 / o l d enter", &[], "with `old`");
    check(typical(), "5 / n o p e enter", &[], "No run matches this filter");
    check(typical(), "5 / n o p e enter esc", &[], "running");
    check(typical(), "5 / o l d", &[], "with `old`");
    check(typical(), "5 / o l d esc", &[], "runs in runs ───");
    check(grouped(), "5 / g u i d e d space s u c c e s s >", &[], "with `guided`");
    check(grouped(), "5 / s t a t e : f i n tab enter", &[], "with `state:finished`");
    check(grouped(), "5 / g a m m", &[], "ddpg.gamma=");
    check(grouped(), "5 / s e e d = enter", &[], "`seed=` ends without a value");
    check(empty(), "5", &[], "There are no runs in this folder yet");
}

#[test]
fn a_run_is_deleted_after_a_question() {
    check(typical(), "5 down X", &[], "With all files: old.");
    check(typical(), "5 down X esc", &[], "running");
    check(typical(), "5 down delete y", &["delete runs/old"], "");
    check(typical(), "5 u", &["restore"], "");
    let mut view = typical();
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(folder.path().join(".trash/1/poor")).unwrap();
    view.folder = folder.path().to_owned();
    check(view.clone(), ": e m p t y - t r a s h enter", &[], "remove 1 deleted run?");
    check(view, ": e m p t y - t r a s h enter y", &["empty-trash"], "");
    check(typical(), "5 X", &[], "not ended yet: task1-ddpg-mge-seed0; x stops it");
    let mut view = typical();
    change_run(&mut view, 1, |run| run.state = RunState::Paused);
    check(view, "5 X", &[], "not ended yet: task1-ddpg-mge-seed0; x stops it");
}

#[test]
fn actions_apply_to_all_marked_runs_after_one_question() {
    check(typical(), "5 down space", &[], "1 marked");
    check(typical(), "5 down space up space", &[], "2 marked");
    check(typical(), "5 down space space", &[], "runs in runs");
    check(typical(), "5 down space up space V", &[], "training · 2 curves");
    check(typical(), "5 down space up space V esc", &[], "training · task1-ddpg-mge-seed0");
    let mut view = grouped();
    view.runs.push(Arc::new(crate::tui::testing::run_on("task4", "other")));
    check(view, "5 space down space V", &[], "training · 2 curves");
    check(grouped(), "5 down X", &[], "With all files: guided-0, guided-1, guided-2.");
    check(typical(), "5 space down space X", &[], "because they have not ended: 1");
    check(typical(), "5 space down space X y", &["delete runs/old"], "");
    let go_on = ["continue runs/old", "continue runs/task1-ddpg-mge-seed0"];
    check(typical(), "5 space down space C", &go_on[1..], "continuing task1-ddpg-mge-seed0; finished: 1 of 2; `:epis");
    let longer = ViewModel { extends_to: Some(4000), ..typical() };
    check(longer, "5 space down space C", &go_on, "continuing old, task1-ddpg-mge-seed0");
    check(typical(), "5 space down space p", &["pause"], "pausing 1");
    check(grouped(), "5 p", &[], "none of plain-0, plain-1, plain-2 is being trained");
    let mut view = typical();
    change_run(&mut view, 1, |run| run.state = RunState::Paused);
    check(view, "5", &[], "p resume ");
    check(typical(), "5 space down space x", &[], "stop 1 run?");
    check(typical(), "5 space down space x y", &["stop"], "");
    let mut view = typical();
    change_run(&mut view, 0, |run| run.state = RunState::Paused);
    let stop = ["open runs/old", "stop", "open runs/task1-ddpg-mge-seed0", "stop"];
    check(view.clone(), "5 space down space x y", &stop, "");
    change_run(&mut view, 1, |run| run.state = RunState::Paused);
    let resume = ["open runs/old", "resume", "open runs/task1-ddpg-mge-seed0", "resume"];
    check(view, "5 space down space p", &resume, "");
    check(typical(), "5 space V", &[], "training · task1-ddpg-mge-seed0");
}

#[test]
fn runs_that_differ_in_the_seed_only_are_one_line_that_unfolds() {
    check(grouped(), "5 down", &[], "DDPG-MGE, epsilon 0.8 to 0.05 (3) ");
    check(grouped(), "5", &[], "3 finished");
    check(grouped(), "5 down tab", &[], "guided-1");
    check(grouped(), "5 tab down down tab enter", &["open runs/plain-0"], "3 finished");
    check(grouped(), "5 tab tab / n o p e enter", &[], "No run matches this filter");
    check(grouped(), "5 enter", &["open runs/plain-0"], "");
    check(grouped(), "5 down enter", &["open runs/guided-0"], "");
    let delete = ["delete runs/guided-0 runs/guided-1 runs/guided-2"];
    check(grouped(), "5 down X y", &delete, "");
    check(grouped(), "5 / s e e d = 1 enter enter", &["open runs/plain-1"], "with `seed=1`");
    check(grouped(), "5 / m e t h o d : d d p g - m g e enter enter", &["open runs/guided-0"], "");
    check(grouped(), "5 / e p s i l o < 1 enter", &[], "did you mean `epsilon`?");
    check(grouped(), "5 / d d p g . g a m a < 1 enter", &[], "did you mean `ddpg.gamma`?");
    check(grouped(), "5 s enter", &["open runs/guided-0"], "by success");
    check(grouped(), "4", &[], "DDPG-MGE, epsilon 0.8 to 0.05");
    check(grouped(), "4 tab", &[], "training · 3 curves");
    check(grouped(), "5 space down space V", &[], "training · 2 curves");
    check(grouped(), "5 down V", &[], "training · DDPG-MGE, epsilon 0.8 to 0.05 (3 seeds)");
}

#[test]
fn notes_and_names_are_written_to_the_run() {
    check(grouped(), "5 tab down i f i n e enter", &["note runs/plain-0 fine"], "");
    let name = "rename runs/plain-0 best";
    check(grouped(), "5 tab down n ctrl-w b e s t enter", &[name], "");
    let mut view = grouped();
    change_run(&mut view, 0, |run| run.note = "holds".into());
    let (mut small, _) = app(view.clone());
    press(&mut small, "5 down tab down");
    let screen = text(&shot(&mut small, 80, 24));
    assert!(screen.contains("note: holds"), "{screen}");
    check(view, "5 / n o t e : h o l d s enter enter", &["open runs/guided-0"], "");
    let (folder, mut view) = (tempfile::tempdir().unwrap(), typical());
    let run = mge_run::RunDirectory::create(folder.path().join("old"), &1).unwrap();
    change_run(&mut view, 0, |old| old.path = run.path().to_owned());
    let (mut app, asked) = app(view);
    press(&mut app, "5 down i m i n e");
    run.change_notes(|notes| notes.note = "theirs".into()).unwrap();
    let is_told = |screen: &str| screen.contains("another program has written `theirs`");
    assert!(!is_told(&text(&shot(&mut app, 120, 40))), "no file is read while one types");
    press(&mut app, "enter");
    let screen = text(&shot(&mut app, 120, 40));
    assert!(is_told(&screen) && asked.borrow().is_empty(), "{screen}");
}

#[test]
fn a_list_of_ten_thousand_runs_is_drawn_around_the_selection() {
    let mut view = empty();
    let names = (0..10_000).map(|number| format!("run-{number:05}"));
    view.runs = names.map(|name| Arc::new(crate::tui::testing::run_summary(&name))).collect();
    view.runs_unread = 12;
    check(view.clone(), "5", &[], "12 more are being read");
    check(view.clone(), "5 down down enter", &["open runs/run-09997"], "run-09997");
    check(view.clone(), "5 end enter", &["open runs/run-00000"], "run-00000");
    check(view, "5 / 0 4 2 1 1 enter enter", &["open runs/run-04211"], "with `04211`");
}

#[test]
fn on_the_runs_screen_the_selected_run_is_paused_and_stopped() {
    check(typical(), "5 down p", &[], "old is finished: there is nothing to pause");
    let stop = ["open runs/old", "stop", "open runs/task1-ddpg-mge-seed0"];
    check(typical(), "5 down x", &stop, "");
    check(typical(), "5 down : s t o p enter", &stop, "");
    // From the list of the palette, too, and by what goes to the training of a run.
    check(typical(), "5 down : k i l l enter", &stop, "");
    for (typed, command) in [("g u i d e", "guide"), ("e p s i l o n space 0 . 3", "epsilon 0.3")] {
        check(typical(), &format!("5 down : {typed} enter"), &[stop[0], command, stop[2]], "");
    }
    check(typical(), "5 down F", &[], ": fork 2000 ");
    check(grouped(), "5 : e p s i l o n space 0 . 3 enter", &["epsilon 0.3"], "");
    check(typical(), "5 x", &[], "stop 1 run?");
    check(typical(), "5 p", &["pause"], "");
}

/// Three runs, the latest last: finished, running and failed.
fn three() -> ViewModel {
    let run = |name: &str, state: RunState, done: u64, success: Option<f64>| {
        Arc::new(RunSummary { state, done, success, ..crate::tui::testing::run_summary(name) })
    };
    let runs = vec![
        run("Finished", RunState::Finished, 100, Some(0.5)),
        run("b", RunState::Running, 50, Some(0.9)),
        run("c", RunState::Failed("no reason".into()), 10, None),
    ];
    ViewModel { runs, ..empty() }
}

#[test]
fn runs_are_sorted_by_age_or_success() {
    for (sorts, order) in [("", "c b Finished"), ("s", "b Finished c"), ("s s", "c b Finished")] {
        sorted(sorts, order);
    }
}

/// Checks the order of the runs after these keys.
fn sorted(keys: &str, order: &str) {
    let order: Vec<&str> = order.split(' ').collect();
    let opened = |keys: String| {
        let (mut app, asked) = app(three());
        press(&mut app, &format!("5 {keys}"));
        asked.borrow().concat()
    };
    for (row, name) in order.iter().enumerate() {
        let downs = "down ".repeat(row);
        assert_eq!(opened(format!("{keys} {downs} enter")), format!("open runs/{name}"), "{keys}, row {row}");
    }
}

#[test]
fn conditions_include_their_bounds_and_exclude_unknown_values() {
    let first = |filter: &str| {
        let (mut app, asked) = app(three());
        press(&mut app, "5 /");
        app.event(Event::Paste(filter.to_owned()));
        press(&mut app, "enter enter");
        asked.borrow().concat()
    };
    assert_eq!(first("done>=50"), "open runs/b");
    assert_eq!(first("done<=50"), "open runs/c");
    assert_eq!(first("success<1"), "open runs/b", "the success of c is unknown");
    assert_eq!(first("name:finished"), "open runs/Finished");
    let mut view = three();
    change_run(&mut view, 0, |run| run.note = "holds".into());
    check(view, "5 / n o t e : h o l d enter enter", &["open runs/Finished"], "");
}

#[test]
fn a_filter_resets_the_selection_and_a_deletion_keeps_its_row() {
    check(three(), "5 end / t a s k enter enter", &["open runs/c"], "");
    let (mut app, asked) = app(three());
    press(&mut app, "5 down");
    let mut left = three();
    left.runs.remove(1);
    bring(&mut app, left);
    press(&mut app, "enter");
    assert_eq!(*asked.borrow(), ["open runs/Finished"]);
    check(typical(), "5 space / o l d enter esc", &[], "1 marked");
}

#[test]
fn a_group_has_the_name_that_its_runs_are_given_together() {
    let of_all = |what: &str, text: &str| [0, 1, 2].map(|seed| format!("{what} runs/plain-{seed} {text}"));
    check(grouped(), "5 n p l a i n enter", &of_all("rename", "plain").each_ref().map(|it| &**it), "plain: 3 runs");
    check(grouped(), "5 i g o o d enter", &of_all("note", "good").each_ref().map(|it| &**it), "good: 3 runs");
    let mut view = grouped();
    (3..6).for_each(|place| change_run(&mut view, place, |run| run.name = "my baseline".into()));
    view.groups = Arc::new(Grouping::new(&view.runs, &Grouping::default()));
    check(view.clone(), "5", &[], "my baseline (3)");
    check(view.clone(), "5 tab", &[], "  my baseline, seed 1");
    check(view.clone(), "5 X", &[], "With all files: my baseline (plain-0), my baseline");
    check(view, "5 V", &[], "3 runs marked, to be compared: esc on the Runs screen removes the marks");
    let mut view = grouped();
    change_run(&mut view, 4, |run| run.note = "my own".into());
    check(view.clone(), "5 i enter", &[], "they differ: a text replaces all of them, none changes nothing");
    check(view, "5 i b enter", &of_all("note", "b").each_ref().map(|it| &**it), "b: 3 runs");
}

#[test]
fn what_cannot_be_done_with_a_line_is_explained() {
    check(typical(), "5 tab", &[], "a group of runs that differ in the seed only");
    check(grouped(), "5 F", &[], "only a single run can be forked");
    check(grouped(), "5 v", &[], "only a single run can be evaluated");
    for typed in ["s t o p", "p a u s e", "f o r k space 9"] {
        check(
            grouped(),
            &format!("5 : {typed} enter"),
            &[],
            "what is typed is for a single run: tab shows the runs of a group",
        );
    }
    check(grouped(), "5 space down V", &[], "training · DDPG (3 seeds)");
    let mut view = typical();
    change_run(&mut view, 0, |run| run.state = RunState::Paused);
    watch(&mut view, 0);
    let stop = ["stop", "open runs/task1-ddpg-mge-seed0", "stop", "open runs/old"];
    check(view, "5 space down space x y", &stop, "");
}

#[test]
fn the_question_on_stopping_runs_says_what_happens_to_each() {
    let asks = |running: usize, queued: usize, shown: &str| {
        let mut view = grouped();
        for index in 0..running {
            change_run(&mut view, index, |run| run.state = RunState::Running);
        }
        for index in running..running + queued {
            change_run(&mut view, index, |run| run.queued = true);
        }
        check(view, "5 space down space x", &[], shown);
    };
    asks(0, 0, "plain-1, plain-2 is being trained");
    asks(1, 1, "guided-0, guided-1: in training");
    asks(0, 1, "stop 1 run?");
    asks(1, 0, "stop 1 run?");
    asks(2, 2, "stop 4 runs?");
}

#[test]
fn a_group_shows_the_most_urgent_state_of_its_runs() {
    let mut view = grouped();
    change_run(&mut view, 1, |run| run.state = RunState::Failed("no reason".into()));
    for place in [3, 4] {
        change_run(&mut view, place, |run| {
            (run.state, run.active, run.done) = (RunState::Running, true, run.done + 500);
        });
    }
    view.runs.push(Arc::new(crate::tui::testing::run_on("task4", "other")));
    let (mut app, _) = app(view.clone());
    press(&mut app, "5");
    let screen = text(&shot(&mut app, 200, 60));
    assert!(screen.contains("1 failed") && screen.contains("task1: DDPG"), "{screen}");
    assert!(screen.contains(" 1:24 "), "1000 and 1100 episodes at 12.5 a second each\n{screen}");
    let (mut app_of_group, _) = super::app(view.clone());
    press(&mut app_of_group, "5 down");
    let about = text(&shot(&mut app_of_group, 200, 60));
    assert!(about.contains("speed 25.0/s") && about.contains("; 2 running, 1 stopped"), "{about}");
    change_run(&mut view, 4, |run| run.done = 900);
    bring(&mut app, view);
    press(&mut app, "end tab down space");
    let marked = |line: &&str| line.contains("* ") || line.contains("*>");
    assert_eq!(text(&shot(&mut app, 200, 60)).lines().filter(marked).count(), 1, "the group is not marked");
    check(grouped(), "5 / s e e d = 1 enter", &[], " plain-1 ");
    check(grouped_watching(3), "4", &[], "training · plain-0");
}

fn grouped_watching(index: usize) -> ViewModel {
    let mut view = grouped();
    watch(&mut view, index);
    view
}

//! Which settings affect a training, and the warnings about those that do not do what they seem to: without effect,
//! contradictory, or longer than the run. They are valid, so that they are no errors, but nobody wants them: whoever
//! starts a training is told.

use std::collections::{BTreeMap, BTreeSet};

use super::config::RunConfig;
use super::method::{Method, PriorSource};
use mge_guidance::EpsilonSchedule;

/// A configuration, and the settings in it that somebody set, by JSON path.
pub type Chosen<'a> = (&'a RunConfig, &'a BTreeSet<String>);

/// The warnings about runs that are started together, one line each: about settings that affect none of the runs for
/// which they were set, and about doubtful combinations.
pub fn warnings<'a>(runs: impl IntoIterator<Item = Chosen<'a>>) -> Vec<String> {
    let mut idle: BTreeMap<&str, Option<String>> = BTreeMap::new();
    let mut found: Vec<String> = Vec::new();
    for (config, set) in runs {
        for path in set {
            let reason = without_effect(config, path);
            let known = idle.entry(path).or_insert_with(|| reason.clone());
            *known = known.take().filter(|_| reason.is_some());
        }
        found.extend(doubts(config));
    }
    let told = |path| if path == "prior" { "model" } else { path };
    let idle =
        idle.into_iter().filter_map(|(path, reason)| Some(format!("`{}` has no effect: {}", told(path), reason?)));
    let mut known = BTreeSet::new();
    idle.chain(found).filter(|warning| known.insert(warning.clone())).collect()
}

impl Method {
    /// Whether the method reads a setting of a run, given by its JSON path.
    pub fn uses(self, path: &str) -> bool {
        match path.split('.').next().unwrap_or(path) {
            "epsilon" | "granularity" => self.follows_epsilon(),
            "refinement" | "practice" => self.has_clusters() && self.learns(),
            "guidance" => self.has_clusters(),
            "prior" | "model" => (self.has_clusters() || self.consults_model()) && self.fixed_source().is_none(),
            "planner" => self == Self::Planning,
            "ddpg" | "noise_decay" | "extended_from" | "hold_tolerance" | "mastered_update_interval" | "evaluation" => {
                self.learns()
            }
            _ => true,
        }
    }
}

impl RunConfig {
    /// Whether a setting, given by its JSON path, affects the training with the other settings.
    pub fn uses(&self, path: &str) -> bool {
        without_effect(self, path).is_none()
    }
}

/// Why a setting has no effect with the others; none if it may have one.
fn without_effect(config: &RunConfig, path: &str) -> Option<String> {
    let RunConfig { method, epsilon, episodes, refinement, evaluation, stop, .. } = config;
    if !method.uses(path) {
        return Some(match method.fixed_source() {
            Some(source) if path == "prior" || path.starts_with("model") => {
                format!("the source of rollouts of `{method}` is always `{}`", String::from(source))
            }
            _ => format!("the method `{method}` does not use it"),
        });
    }
    let by_need = matches!(epsilon, EpsilonSchedule::Need { .. });
    let is_noisy = !matches!(epsilon, EpsilonSchedule::Need { noise: 0.0, .. });
    let is_unguided = method.has_clusters() && !config.is_guided();
    let is_uniform = config.rollout_source() == PriorSource::Uniform;
    let is_trained = matches!(config.rollout_source(), PriorSource::Trained(_));
    let idle: [(&[&str], bool, &str); 13] = [
        (
            &["guidance", "prior", "model", "practice", "refinement"],
            is_unguided,
            "without clusters, as epsilon is always 0",
        ),
        (&["hold_tolerance", "mastered_update_interval"], !by_need, "epsilon does not depend on need"),
        (&["noise_decay", "extended_from", "ddpg.ou"], !is_noisy, "epsilon leaves no share to the noise"),
        (
            &["noise_decay.share", "extended_from"],
            config.noise_decay.final_scale >= 1.0,
            "`noise_decay.final_scale` is 1",
        ),
        (&["ddpg.imitation.weight"], config.ddpg.imitation.share == 0.0, "`ddpg.imitation.share` is 0"),
        (&["practice.enough"], config.practice.rollouts == 0, "`practice.rollouts` is 0"),
        (&["refinement.least", "refinement.most"], refinement.every == 0, "`refinement.every` is 0"),
        (
            &["guidance"],
            is_uniform && refinement.every == 0,
            "actions are uniform, and nothing refines them to clusters",
        ),
        (&["model"], !is_trained, "no model is trained for the run, as it is given"),
        (&["stop.success"], stop.success.is_some() && *episodes < 100, "the run is shorter than 100 episodes"),
        (&["evaluation.every"], evaluation.every > *episodes, "it is longer than the run"),
        (&["evaluation.episodes"], evaluation.every == 0, "`evaluation.every` is 0"),
        (&["checkpoints.periodic_kept"], config.checkpoints.periodic_every == 0, "`checkpoints.periodic_every` is 0"),
    ];
    let is_part = |whole: &&str| path.strip_prefix(whole).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
    let found = idle.into_iter().find(|(paths, is_idle, _)| *is_idle && paths.iter().any(is_part));
    found.map(|(_, _, reason)| reason.to_owned())
}

/// What is doubtful about the settings together.
fn doubts(config: &RunConfig) -> Vec<String> {
    let RunConfig { method, epsilon, episodes, .. } = config;
    let mut doubts = Vec::new();
    if method.is_adaptive() && !matches!(epsilon, EpsilonSchedule::Need { .. }) {
        let usual = RunConfig::default_for(config.task.clone(), *method).epsilon;
        doubts.push(match method.has_clusters() {
            true => format!(
                "epsilon {epsilon} cripples `{method}`, which explores by need: its default is {usual}; a method with a \
                 schedule is `ddpg-mge`"
            ),
            false => format!(
                "epsilon {epsilon} has no effect but to end the exploration by need: `{method}` has no clusters to \
                 choose, so noise is always added; its default is {usual}"
            ),
        });
    }
    if method.uses("epsilon")
        && let Some((wanted, end)) = epsilon.unreached(*episodes)
    {
        doubts.push(format!(
            "epsilon {epsilon} is longer than the run: after {episodes} episodes it is {end}, {wanted}; shorten it, or \
             raise `episodes`"
        ));
    }
    doubts
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    fn told(method: Method, settings: &[(&str, &str)]) -> Vec<String> {
        let mut config = RunConfig::default_for(Arc::new(mge_task::load("task1").unwrap()), method);
        for (key, value) in settings {
            config = config.with_unchecked_setting(key, value).unwrap();
        }
        let set = settings.iter().map(|(key, _)| (*key).to_owned()).collect();
        warnings([(&config, &set)])
    }

    #[test]
    fn a_setting_matters_to_the_methods_that_read_it() {
        use Method::*;
        let learning = [Ddpg, DdpgMge, DdpgUniform, DdpgMgeTrue, DdpgMgeAdaptive, DdpgUniformAdaptive, DdpgAdaptive];
        let table: [(&str, &[Method]); 8] = [
            ("epsilon", &[DdpgMge, DdpgUniform, DdpgMgeTrue, DdpgMgeAdaptive, DdpgUniformAdaptive, DdpgAdaptive]),
            ("guidance.horizon", &[DdpgMge, DdpgUniform, DdpgMgeTrue, DdpgMgeAdaptive, DdpgUniformAdaptive, OpenLoop]),
            ("prior", &[DdpgMge, Planning, DdpgMgeAdaptive, OpenLoop]),
            ("planner.rollouts", &[Planning]),
            ("ddpg.gamma", &learning),
            ("noise_decay.share", &learning),
            ("evaluation.every", &learning),
            ("seed", &Method::ALL),
        ];
        for (path, methods) in table {
            let using: Vec<Method> = Method::ALL.into_iter().filter(|method| method.uses(path)).collect();
            assert_eq!(using, methods, "{path}");
        }
    }

    #[test]
    fn no_method_is_warned_about_with_its_usual_settings() {
        for method in Method::ALL {
            assert_eq!(told(method, &[]), [""; 0], "{method}");
            let all: BTreeSet<String> = ["seed", "episodes", "method", "start_noise"].map(str::to_owned).into();
            let config = RunConfig::default_for(Arc::new(mge_task::load("task3").unwrap()), method);
            assert_eq!(warnings([(&config, &all)]), [""; 0], "{method}");
        }
    }

    #[test]
    fn each_misuse_is_told_in_one_line() {
        use Method::*;
        /// A method, settings, and what the line has.
        type Case = (Method, &'static [(&'static str, &'static str)], &'static str);
        let cases: [Case; 21] = [
            (DdpgMgeAdaptive, &[("epsilon", "0.1")], "cripples `ddpg-mge-adaptive`"),
            (DdpgAdaptive, &[("epsilon", "linear:0.5:0:1000")], "its default is need:0:0.75:20"),
            (DdpgAdaptive, &[("epsilon", "0.3")], "epsilon 0.3 has no effect but to end"),
            (DdpgMge, &[("episodes", "500")], "after 500 episodes it is 0.25"),
            (DdpgMge, &[("episodes", "500"), ("epsilon", "exp:0.8:0:0.999")], "longer than the run"),
            (DdpgMge, &[("episodes", "500"), ("epsilon", "step:0.8:0.5:600")], "longer than the run"),
            (DdpgMge, &[("episodes", "500"), ("epsilon", "points:0=0.8,501=0")], "longer than the run"),
            (Ddpg, &[("epsilon", "0.1")], "`epsilon` has no effect: the method `ddpg` does not use it"),
            (DdpgMge, &[("planner.rollouts", "3")], "`planner.rollouts` has no effect"),
            (Planning, &[("ddpg.gamma", "0.9")], "`ddpg.gamma` has no effect"),
            (
                DdpgUniform,
                &[("prior", "true")],
                "`model` has no effect: the source of rollouts of `ddpg-uniform` is always `uniform`",
            ),
            (DdpgMge, &[("epsilon", "0"), ("guidance.horizon", "4")], "epsilon is always 0"),
            (DdpgMge, &[("hold_tolerance", "0.2")], "epsilon does not depend on need"),
            (DdpgMgeAdaptive, &[("epsilon", "need:0.5:0:20"), ("ddpg.ou.sigma", "0.2")], "no share to the noise"),
            (DdpgMgeAdaptive, &[("noise_decay.share", "0.2")], "`noise_decay.final_scale` is 1"),
            (Ddpg, &[("ddpg.imitation.weight", "1")], "`ddpg.imitation.share` is 0"),
            (DdpgMge, &[("practice.enough", "4")], "`practice.rollouts` is 0"),
            (DdpgMge, &[("refinement.least", "4")], "`refinement.every` is 0"),
            (DdpgUniform, &[("guidance.std_floor", "0.1")], "nothing refines them"),
            (Ddpg, &[("episodes", "99"), ("stop.success", "0.8")], "shorter than 100 episodes"),
            (DdpgMge, &[("checkpoints.periodic_kept", "5")], "`checkpoints.periodic_every` is 0"),
        ];
        for (method, settings, expected) in cases {
            let told = told(method, settings);
            assert!(told.len() == 1 && told[0].contains(expected) && !told[0].contains('\n'), "{settings:?}: {told:?}");
        }
        assert!(told(Ddpg, &[("episodes", "99"), ("stop.success", "null")]).is_empty(), "it is switched off");
    }

    #[test]
    fn a_setting_without_effect_in_some_of_several_runs_is_no_misuse() {
        let task = Arc::new(mge_task::load("task1").unwrap());
        let [plain, guided] =
            [Method::Ddpg, Method::DdpgMge].map(|method| RunConfig::default_for(task.clone(), method));
        let set = BTreeSet::from(["epsilon".to_owned()]);
        assert_eq!(warnings([(&plain, &set), (&guided, &set)]), [""; 0]);
        assert_eq!(warnings([(&guided, &set), (&plain, &set)]), [""; 0]);
        assert_eq!(warnings([(&plain, &set), (&plain, &set)]).len(), 1);
    }
}

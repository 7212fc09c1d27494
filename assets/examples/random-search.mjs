// Random search in JavaScript: `mge env serve` as an environment, one line of JSON each way.
//
//     node assets/examples/random-search.mjs [task] [episodes]     (needs `mge` on the PATH, or MGE)

import { spawn } from "node:child_process";
import { createInterface } from "node:readline";

const [task = "task1", episodes = "200"] = process.argv.slice(2);
const server = spawn(process.env.MGE ?? "mge", ["env", "serve", task], { stdio: ["pipe", "pipe", "inherit"] });
const answers = createInterface({ input: server.stdout })[Symbol.asyncIterator]();

async function ask(request) {
  server.stdin.write(JSON.stringify(request) + "\n");
  const { value, done } = await answers.next();
  if (done) throw new Error("the environment has ended");
  const answer = JSON.parse(value);
  if (answer.error) throw new Error(answer.error);
  return answer;
}

let best = { total: -Infinity }, goals = 0;
for (let episode = 0; episode < Number(episodes); episode++) {
  await ask({ command: "reset", seed: episode });
  const actions = [];
  let total = 0, answer;
  do {
    actions.push([2 * Math.random() - 1, 2 * Math.random() - 1]);
    answer = await ask({ command: "step", action: actions.at(-1) });
    total += answer.reward;
  } while (!answer.terminated && !answer.truncated);
  goals += answer.info.goal;
  if (total > best.total) best = { total, episode, actions };
}
await ask({ command: "close" });
console.log(`${goals} of ${episodes} random episodes of ${task} reached the goal`);
console.log(`the best return is ${best.total.toFixed(2)}, of episode ${best.episode} with ${best.actions.length} actions`);

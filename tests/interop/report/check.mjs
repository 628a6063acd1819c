// Opens a report in headless Chromium: the console is quiet, every figure is drawn with finite numbers, curves toggle, values are read, a drag zooms and a double click
// resets, dark mode and print work. Prints what it saw as JSON.
// Usage: node check.mjs PAGE.html CHROMIUM LEAST_FIGURES [SCREENSHOT.png]
import { stat } from 'node:fs/promises';
import { resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import puppeteer from 'puppeteer-core';

const MOST_BYTES = 5e6;
const MOST_SECONDS = 2;
const [file, chromium, least, screenshot] = process.argv.slice(2);
const problems = [];
const check = (right, what) => { if (!right) problems.push(what); };

const size = (await stat(file)).size;
check(size < MOST_BYTES, `the page has ${size} bytes, wanted fewer than ${MOST_BYTES}`);
const browser = await puppeteer.launch({ executablePath: chromium, args: ['--no-sandbox', '--disable-dev-shm-usage'] });
let seen = {};
try {
  const page = await browser.newPage();
  await page.setViewport({ width: 1280, height: 900 });
  page.on('console', (message) => { if (message.type() === 'error' || message.type() === 'warning') problems.push(`console: ${message.text()}`); });
  page.on('pageerror', (error) => problems.push(`page: ${error.message}`));
  page.on('request', (request) => { if (!request.url().startsWith('file:') && !request.url().startsWith('data:')) problems.push(`asks the network for ${request.url()}`); });
  const started = performance.now();
  await page.goto(pathToFileURL(resolve(file)).href, { waitUntil: 'load' });
  const seconds = (performance.now() - started) / 1e3;
  check(seconds < MOST_SECONDS, `it took ${seconds.toFixed(2)} s to open, wanted less than ${MOST_SECONDS}`);

  // what is closed is not drawn
  await page.evaluate(() => document.querySelectorAll('details').forEach((part) => { part.open = true; }));
  const figures = await page.$$eval('svg.figure', (all) => all.map((svg) => {
    const box = svg.getBoundingClientRect();
    const numbers = (text) => (text.match(/-?[\d.]+(?:e[-+]?\d+)?|NaN|Infinity/gi) || []);
    const panels = [...svg.querySelectorAll('.panel')].map((group) => {
      const paths = [...group.querySelectorAll('path.line, path.band')].map((path) => numbers(path.getAttribute('d') || ''));
      const marks = group.querySelectorAll('.mark, .dot, .bar, circle, ellipse').length;
      const axes = group.dataset.panel ? JSON.parse(group.dataset.panel) : null;
      const finite = axes === null || ['x', 'y'].every((key) => Number.isFinite(axes[key].low) && Number.isFinite(axes[key].high) && axes[key].high > axes[key].low);
      // an empty panel must say so
      const said = /nothing above the noise/.test(group.querySelector('.title')?.textContent || '');
      return { said, points: paths.reduce((sum, path) => sum + path.length / 2, 0), marks, finite, bad: paths.some((path) => path.some((n) => !Number.isFinite(Number(n)))) };
    });
    return { title: svg.getAttribute('aria-label') || svg.querySelector('title')?.textContent || '', width: box.width, height: box.height, panels };
  }));
  check(figures.length >= Number(least), `${figures.length} figures, wanted at least ${least}`);
  figures.forEach((figure, index) => {
    const name = `figure ${index + 1} (${figure.title})`;
    check(figure.width > 200 && figure.height > 80, `${name} is ${figure.width} by ${figure.height} points large`);
    check(figure.panels.length > 0, `${name} has no panel`);
    figure.panels.forEach((panel, k) => {
      check(panel.finite, `${name}, panel ${k + 1}: limits are not finite`);
      check(!panel.bad, `${name}, panel ${k + 1}: a curve holds what is no number`);
      check(panel.points >= 2 || panel.marks > 0 || panel.said, `${name}, panel ${k + 1} is empty`);
    });
  });

  // the first figure with a legend and a curve: toggle, read, zoom, reset
  const target = (await page.$$('svg.figure')).map((svg) => svg);
  let tried = 0;
  for (const svg of target) {
    const usable = await svg.evaluate((svg) => svg.querySelector('.key') !== null && svg.querySelector('.panel[data-panel] path.line') !== null);
    if (!usable || tried > 1) continue;
    tried += 1;
    await svg.evaluate((svg) => svg.scrollIntoView({ block: 'center', behavior: 'instant' }));
    await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
    const hidden = () => svg.evaluate((svg) => svg.querySelectorAll('.hidden').length);
    const before = await hidden();
    const press = () => svg.evaluate((svg) => svg.querySelector('.key').dispatchEvent(new MouseEvent('click', { bubbles: true })));
    await press();
    check((await hidden()) > before, 'a click on the legend hides nothing');
    await press();
    check((await hidden()) === before, 'a second click on the legend does not bring the curve back');
    const frame = await svg.evaluate((svg) => { const box = svg.querySelector('.panel[data-panel] .frame').getBoundingClientRect(); return { x: box.x, y: box.y, width: box.width, height: box.height }; });
    const at = (u, v) => [frame.x + u * frame.width, frame.y + v * frame.height];
    let read = '';
    for (const u of [0.5, 0.3, 0.2, 0.1, 0.7]) {
      await page.mouse.move(...at(u, 0.5));
      read = await page.$eval('#readout', (readout) => (readout.hidden ? '' : readout.textContent));
      if (read) break;
    }
    check(/\d/.test(read), 'the pointer reads no value');
    const ticks = () => svg.evaluate((svg) => [...svg.querySelectorAll('.panel[data-panel] .tick')].map((tick) => tick.textContent).join(' '));
    const home = await ticks();
    await page.mouse.move(...at(0.3, 0.3));
    await page.mouse.down();
    await page.mouse.move(...at(0.5, 0.6), { steps: 4 });
    await page.mouse.up();
    check((await ticks()) !== home, 'a drag does not zoom');
    await svg.evaluate((svg) => svg.querySelector('.panel[data-panel]').dispatchEvent(new MouseEvent('dblclick', { bubbles: true })));
    check((await ticks()) === home, 'a double click does not reset');
  }
  check(tried > 0, 'no figure has a legend and a curve');

  const ground = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: 'light' }]);
  const light = await ground();
  await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: 'dark' }]);
  check((await ground()) !== light, 'dark mode looks like light mode');
  await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: 'light' }]);
  if (screenshot) {
    await page.evaluate(() => scrollTo(0, 0));
    await page.screenshot({ path: screenshot, fullPage: false });
  }
  const pdf = await page.pdf({ format: 'A4' });
  check(pdf.length > 20_000, `the print has ${pdf.length} bytes`);
  seen = { file, bytes: size, seconds: Number(seconds.toFixed(2)), figures: figures.length, points: Math.round(figures.flatMap((f) => f.panels).reduce((sum, p) => sum + p.points, 0)) };
} finally {
  await browser.close();
}
console.log(JSON.stringify(seen));
if (problems.length > 0) {
  console.error(problems.join('\n'));
  process.exit(1);
}

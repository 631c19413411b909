// What the session told this page: its setting, and the lines of the waterfall.
const token = document.querySelector('meta[name=token]').content;
export const ask = {headers: {'X-Ensonify-Token': token}};

export let setting = null, settingNumber = 0;
export function keepSetting(json) {
  setting = json;
  ++settingNumber;
}

const mostRows = 6000;
export const rows = new Map();  // by sonar: its rows, the oldest first
export const of = sonar => rows.get(sonar) ?? rows.set(sonar, {first: 0, list: []}).get(sonar);
export function keepRow(sonar, row) {
  const store = of(sonar);
  store.list.push(row);
  if (store.list.length > mostRows + 500) {
    store.list.splice(0, 500);
    store.first += 500;
  }
}
